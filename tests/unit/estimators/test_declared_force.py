"""Friction where the record does not swing at the frequency of the declared mass and stiffness."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import slow_decay
from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.core.declared_force import declared_forces
from friction_bayes.core.quantities import quantity_named
from friction_bayes.estimators.equally_probable import EquallyProbable

RIGHT: dict[str, Any] = {"mass": 10.0, "stiffness": 1000.0}
FRICTION = 0.07
NOISE = {"displacement": 2e-4, "velocity": 2e-3, "acceleration": 2e-2}
RECORDS = 12
pytestmark = [
    pytest.mark.filterwarnings("ignore:the record swings:friction_bayes.core.errors.RecordWarning"),
    pytest.mark.filterwarnings(
        "ignore:.* records have warnings .the frequency is far from:friction_bayes.core.errors.RecordWarning"
    ),
]


def record(seed: int, quantity: str = "displacement") -> xr.DataArray:
    return slow_decay(friction=FRICTION, noise_sd=NOISE[quantity], seed=seed, quantity=quantity)


def declared(**changed: Any) -> fb.Oscillator:
    return fb.Oscillator(**(RIGHT | changed))


@pytest.mark.parametrize("quantity", NOISE)
@pytest.mark.parametrize("share", [0.95, 0.98, 1.02, 1.05])
def test_the_interval_covers_whichever_is_off(quantity: str, share: float, seed: int) -> None:
    records = [record(seed + i, quantity) for i in range(RECORDS)]
    stack = xr.concat(records, dim="record", combine_attrs="override")
    stiffness, mass = 1000.0 * share, 10.0 * share
    covering = {
        "stiffness off": declared(stiffness=stiffness),
        "mass off": declared(mass=mass),
        "mass trusted": declared(stiffness=stiffness, trust="mass"),
        "stiffness trusted": declared(mass=mass, trust="stiffness"),
        "mass known better": declared(stiffness=stiffness, stiffness_sd=0.05 * stiffness, mass_sd=0.001),
    }
    for what, system in covering.items():
        found = fb.estimate_batch(stack, system, method="envelope")["friction_interval90"].values
        covered = int(np.sum((found[:, 0] <= FRICTION) & (found[:, 1] >= FRICTION)))
        # of twelve at 90 % fewer than six are covered once in 20,000
        assert covered >= 6, (what, covered)
    wrong = fb.estimate_batch(stack, declared(stiffness=stiffness, trust="stiffness"), method="envelope")
    low, high = wrong["friction_interval90"].values.T
    assert np.mean((low > FRICTION) | (high < FRICTION)) > 0.8


def test_nothing_changes_where_they_agree(seed: int) -> None:
    one = fb.estimate(record(seed), declared(), random_force="none")
    assert one.friction.interval(0.9) == one.friction_as_declared.interval(0.9)
    assert not any("swings at" in note for note in one.notes)


def test_both_forces_are_said_in_one_sentence(seed: int) -> None:
    one = fb.estimate(record(seed), declared(stiffness=970.0), method="envelope")
    (note,) = [note for note in one.notes if "swings at" in note]
    middle = float(one.fit.coefficient.mean())
    assert f"{970.0 * middle:.4g} N with the declared stiffness" in note
    assert f"{10.0 * one.frequency**2 * middle:.4g} N with the declared mass" in note
    assert "spans both" in note
    assert one.to_dict()["includes_system_uncertainty"] is True


@pytest.mark.parametrize(
    ("spread", "quantity"),
    [*(({}, quantity) for quantity in NOISE), ({"stiffness_sd": 2.0, "mass_sd": 0.01}, "acceleration")],
)
def test_batch_gives_the_same(spread: dict[str, float], quantity: str, seed: int) -> None:
    system = declared(stiffness=960.0, **spread)
    records = [record(seed + i, quantity) for i in range(2)]
    found = fb.estimate_batch(
        xr.concat(records, dim="record", combine_attrs="override"), system, method="envelope"
    )
    for i, each in enumerate(records):
        friction = fb.estimate(each, system, method="envelope").friction
        assert isinstance(friction, EquallyProbable if spread else Mixture)
        np.testing.assert_allclose(found["friction_interval90"][i], friction.interval(0.9), rtol=1e-7)
        assert found["friction_mean"].values[i] == pytest.approx(friction.mean(), rel=1e-9)
        assert found["friction_sd"].values[i] == pytest.approx(friction.std(), rel=1e-9)


def test_standard_deviations_are_combined_through_the_frequency() -> None:
    """Against draws of mass and stiffness kept where their ratio is that of the frequency."""
    system = declared(stiffness=1020.0, stiffness_sd=20.0, mass_sd=0.3)
    (found,) = declared_forces(system, quantity_named("displacement"), 10.0, disagree=False)
    rng = np.random.default_rng(1)
    stiffness = np.exp(np.log(1020.0) + 20.0 / 1020.0 * rng.standard_normal(2_000_000))
    mass = np.exp(np.log(10.0) + 0.03 * rng.standard_normal(2_000_000))
    kept = stiffness[np.abs(stiffness / mass - 100.0) < 0.2]
    assert found.factor == pytest.approx(kept.mean(), rel=5e-4)
    assert found.relative_sd == pytest.approx(kept.std() / kept.mean(), rel=0.02)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"stiffness_sd": 1001.0}, "stiffness_sd"),
        ({"mass_sd": 11.0}, "mass_sd"),
        ({"trust": "inertia"}, "trust"),
    ],
)
def test_what_cannot_be_is_refused(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(fb.InputError, match=said):
        declared(**changed)


def test_a_mixture_in_equal_parts(seed: int) -> None:
    from scipy import stats

    either = EquallyProbable([stats.norm(1.0, 0.1), stats.norm(2.0, 0.1)])
    assert either.ppf(0.05) == pytest.approx(stats.norm.ppf(0.1, 1.0, 0.1), rel=1e-9)
    assert either.isf(0.05) == pytest.approx(stats.norm.isf(0.1, 2.0, 0.1), rel=1e-9)
    draws = either.rvs(20_000, random_state=np.random.default_rng(seed))
    assert (either.mean(), either.std()) == pytest.approx((1.5, np.hypot(0.5, 0.1)))
    assert draws.mean() == pytest.approx(1.5, abs=0.02)
    assert np.exp(either.logpdf(1.1)) == pytest.approx(either.pdf(1.1))
