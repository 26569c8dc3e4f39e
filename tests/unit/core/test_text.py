"""Numbers as people read them."""

from __future__ import annotations

import pytest

from friction_bayes.core.text import interval


@pytest.mark.parametrize(
    ("low", "high", "written"),
    [
        (0.3620408, 0.3620410, "0.3620408 .. 0.362041"),
        (-0.01234567, 0.2, "-0.0123 .. 0.2"),
        (0.1 + 0.2, 0.3, "0.30000000000000004 .. 0.29999999999999999"),
        (0.5, 0.5, "0.5 .. 0.5"),
        (None, None, "– .. –"),
    ],
)
def test_an_interval_has_digits_enough_to_be_seen(low: float, high: float, written: str) -> None:
    assert interval(low, high, 3) == written
