"""What several records say of each other."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from friction_bayes.loop.checks import between_records


@pytest.mark.parametrize(("second", "expected"), [(np.zeros(400), None), (np.full(400, 2.0), 1.0)])
def test_a_record_that_surely_has_no_friction_is_compared_with_none(
    monkeypatch: pytest.MonkeyPatch, second: np.ndarray, expected: float | None
) -> None:
    """Frictions of 2 - 2 ** 0.5 and 2, an sd of one each, have a chi-square of one."""
    scatter = np.tile([-1.0, 1.0], 200)
    drawn = iter([2.0 - 2.0**0.5 + scatter, second + scatter * second.any()])
    monkeypatch.setattr(between_records.LawFit, "of", lambda one: one)
    monkeypatch.setattr(
        between_records, "draw_laws", lambda *given: SimpleNamespace(friction=next(drawn)) if given else None
    )
    rng = np.random.default_rng(1)
    found = between_records._reduced_chi_square([object(), object()], rng)  # type: ignore[list-item]
    assert found == (expected if expected is None else pytest.approx(expected))
