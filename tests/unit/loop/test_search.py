from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr
from friction_bayes.loop.search.expansion import Expansion
from friction_bayes.loop.search.search import Search

import friction_bayes as fb
from decays import SYSTEM, long_decay
from experiments.laplace_evidence import log_evidence, posterior_probabilities
from friction_bayes.loop.data.effect_sets import searched
from friction_bayes.loop.data.model import LoopModel, changes_signal
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.data.starting_point import starting_point
from friction_bayes.loop.noise.likelihood import NoiseModel
from friction_bayes.loop.simulation.fit import LoopFit, fit_growing_record, fit_model
from friction_bayes.mechanics.effects import EFFECTS

WHITE = (np.zeros(0),)
SEARCHED = searched(EFFECTS, named=False)


def fitted(record: xr.DataArray, *names: str) -> LoopFit:
    model = LoopModel(SYSTEM, cut_records([record], SYSTEM), names)
    fit = fit_growing_record(model, [NoiseModel(WHITE[0])], starting_point(model))
    assert fit is not None
    return fit


def searched(record: xr.DataArray) -> Search:
    search = Search(SYSTEM, cut_records([record], SYSTEM), SEARCHED, WHITE)
    search.run()
    return search


def test_strong_damping_of_a_record_that_comes_to_rest_is_found() -> None:
    """The Coulomb fit of this record stops early, in an optimum from which no linear step leads on."""
    record = long_decay(
        friction=0.5,
        duration=33.0,
        sampling_rate=200.0,
        seed=1,
        effects={"viscous_damping.damping_ratio": 0.003},
    )
    report = fb.close_loop([record], SYSTEM, seed=1)
    assert report.candidates[0]["effects"] == ["viscous_damping"]
    weighed = [c["effects"] for c in report.candidates]
    assert ["friction_drift"] in weighed
    low, high = report.friction_after["interval90"]
    assert low < 0.5 < high


def test_every_single_effect_is_weighed(seed: int) -> None:
    search = searched(long_decay(seed=seed, effects={"viscous_damping.damping_ratio": 0.004}))
    for name in SEARCHED:
        if changes_signal(name):
            assert frozenset({name}) in search.candidates, name


@pytest.mark.parametrize(
    ("names", "settings"),
    [
        (
            {"cubic_stiffness", "sensor_offset"},
            {"cubic_stiffness.cubic_stiffness": 4e4, "sensor_offset.offset": 0.003},
        ),
        (
            {"quadratic_drag", "periodic_interference"},
            {
                "quadratic_drag.drag_coefficient": 2.0,
                "periodic_interference.amplitude": 0.002,
                "periodic_interference.frequency": 4.1,
            },
        ),
        (
            {"viscous_damping", "sensor_drift", "outliers"},
            {
                "viscous_damping.damping_ratio": 0.005,
                "sensor_drift.rate": 5e-4,
                "outliers.fraction": 0.03,
                "outliers.scale": 0.01,
            },
        ),
    ],
)
def test_combinations_are_found(names: set[str], settings: dict[str, float], seed: int) -> None:
    search = searched(long_decay(seed=seed, effects=settings))
    best = search.ranked()[0]
    # one law of dissipation may stand for another, but none may be missing
    dissipation = {"viscous_damping", "quadratic_drag", "friction_drift", "stribeck_friction"}
    assert bool(best.effects & dissipation) >= bool(names & dissipation)
    others = set(SEARCHED) - dissipation - {"asymmetric_friction"}
    assert best.effects & others == names & others
    # what was planted is a hundred times less probable than the best in fewer than one record in a hundred
    planted = search.candidates[frozenset(names)]
    assert planted.log_weight > best.log_weight - math.log(100.0)


def test_flat_samples_are_censored(seed: int) -> None:
    record = long_decay(seed=seed, effects={"sensor_clipping.level": 0.03})
    best = searched(record).ranked()[0]
    assert best.effects == {"sensor_clipping"}
    assert float(best.fit.model.value(best.fit.z, "friction")) == pytest.approx(0.25, rel=0.03)


def test_expansion_foresees_what_fits_will_find(seed: int) -> None:
    """Log-evidence of a pair about a single, to second order, against that of its own fit."""
    record = long_decay(
        seed=seed, effects={"sensor_offset.offset": 0.002, "viscous_damping.damping_ratio": 0.002}
    )
    centre = fitted(record, "viscous_damping")
    reference = log_evidence(centre)
    foreseen = {
        g.effects: g for g in Expansion(centre, ["sensor_offset", "friction_drift"]).approximations(2)
    }
    for names in ({"viscous_damping", "sensor_offset"}, {"viscous_damping"}, {"friction_drift"}):
        approximation = foreseen[frozenset(names)]
        model = centre.model.with_effects(tuple(names))
        fit = fit_model(model, centre.noise_models, approximation.coordinates(model))
        assert fit is not None
        assert approximation.log_gain == pytest.approx(log_evidence(fit) - reference, abs=0.7)


def test_effects_that_exclude_each_other_are_never_judged_together(seed: int) -> None:
    expansion = Expansion(fitted(long_decay(seed=seed)), ["sensor_offset", "sensor_drift"])
    judged = [g.effects for g in expansion.approximations(2)]
    assert frozenset({"sensor_offset", "sensor_drift"}) not in judged
    assert len(judged) == 3


def test_another_number_of_half_cycles_before_the_rest_is_tried(seed: int) -> None:
    """From the fit that rests a half cycle early the true number is found again."""
    record = long_decay(seed=seed, friction=0.6, duration=20.0)
    search = searched(record)
    best = search.candidates[frozenset()]
    turns = best.fit.predictions[0].turning_times.size
    z = best.fit.z.copy()
    model = best.fit.model
    z[model.index("friction")] *= 1.0 + 1.3 / turns
    wrong = fit_model(model, best.fit.noise_models, z, iterations=1)
    assert wrong is not None
    search.candidates.clear()
    search._keep(frozenset(), wrong)
    again = search._with_other_stops(search.candidates[frozenset()])
    assert again.fit.objective == pytest.approx(best.fit.objective, abs=0.1)


def test_evidences_of_different_samples_are_refused(seed: int) -> None:
    first, other = fitted(long_decay(seed=seed)), fitted(long_decay(seed=seed + 1))
    assert posterior_probabilities([first, first], np.array([0.0, math.log(3.0)])) == pytest.approx(
        [0.25, 0.75]
    )
    with pytest.raises(fb.InputError, match="different samples"):
        posterior_probabilities([first, other], np.zeros(2))
