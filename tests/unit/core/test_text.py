"""Numbers as people read them."""

from __future__ import annotations

import pytest

from friction_bayes.core.text import interval, time_span


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


@pytest.mark.parametrize(
    ("start", "end", "written"),
    [
        (0.0, 19.994, "0 to 19.99 s"),
        (10.514, 14.08, "10.51 to 14.08 s"),
        (-1.4731e-05, 18.1131, "-1.473e-05 to 18.11 s"),
        (1761440000.0, 1761440012.678, "1761440000 to 1761440012.68 s"),
        (5.0, 5.0, "5 to 5 s"),
    ],
)
def test_times_far_from_zero_have_digits_enough(start: float, end: float, written: str) -> None:
    assert time_span(start, end) == written
