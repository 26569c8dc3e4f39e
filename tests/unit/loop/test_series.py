"""A series from outside the catalogue: each of its extents is an effect's shape of its own."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from friction_bayes.core.arrays import Array
from friction_bayes.loop.infer.law_draws import draw_laws
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.mechanics.effects import EFFECTS, Extent, Parameter, SensorEffect, register
from friction_bayes.mechanics.effects.prior import normal
from unsteady_decays import RELEASE, bent_record, fitted, probability_of

NARROW = 0.01


def distort(signal: Array, time: Array, third: float, fourth: float) -> Array:
    scaled = signal / RELEASE
    return signal + RELEASE * (third * scaled**3 + fourth * scaled**4)


@pytest.fixture
def series() -> Iterator[str]:
    """One term or two; of two the coefficients may be five times as large."""
    effect = SensorEffect(
        name="sensor_series",
        summary="+ c x^3 + d x^4",
        parameters=tuple(
            Parameter(name=name, unit="1", default=0.0, prior=lambda scales: normal(NARROW))
            for name in ("third", "fourth")
        ),
        distort=distort,
        per_record=False,
        series=(Extent(1), Extent(2, 5.0)),
    )
    register(effect)
    yield effect.name
    del EFFECTS[effect.name]


@pytest.mark.parametrize(("third", "fourth", "width"), [(0.008, 0.0, 1.0), (0.06, -0.04, 5.0)])
def test_each_extent_is_evaluated_and_its_parameters_are_read(
    series: str, rng: np.random.Generator, third: float, fourth: float, width: float
) -> None:
    straight = bent_record(rng, 0.0)
    record = straight.copy(data=distort(straight.values, straight["time"].values, third, fourth))
    fit = fitted(record, ("viscous_damping", series))
    offered = [[fit.law.columns[j] for j in columns] for columns in fit.law.alternatives(series)]
    assert [[(c.width, c.scale) for c in columns] for columns in offered] == [
        [(1.0, NARROW)],
        [(5.0, 5.0 * NARROW)] * 2,
    ]
    assert probability_of(fit, series) > 0.99
    best = [fit.law.columns[j] for j in np.flatnonzero(fit.regression.sets[fit.chosen])]
    assert {c.width for c in best if c.effect == series} == {width}
    drawn = draw_laws(LawFit.of(fit), rng, 400).first.parameters(series, np.ones(400, np.bool_))
    assert drawn["third"].mean() == pytest.approx(third, abs=0.003)
    assert drawn["fourth"].mean() == pytest.approx(fourth, abs=0.003)
