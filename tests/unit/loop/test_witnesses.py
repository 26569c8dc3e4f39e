"""Friction by the loss of amplitude and by the shape within a cycle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from curtailed import at_least
from friction_bayes.loop.checks.witnesses import two_witnesses
from friction_bayes.loop.infer.record_fit import ForceFit
from unsteady_decays import FRICTION, RELEASE, SYSTEM, fitted, sensed, unsteady_motion

NOISE = 2e-5


def held_record(rng: np.random.Generator, held: float, order: int = 0) -> xr.DataArray:
    """A decay whose sensor lags behind the direction by a length ``held``."""
    motion = unsteady_motion(rng, samples=2000)
    off = NOISE * 10.0**order * rng.standard_normal(motion[0].size)
    return sensed(motion[order] - held * np.sign(motion[1]) + off, order)


def heard(
    rng: np.random.Generator, *, held: float = 0.0, order: int = 0, effects: tuple[str, ...] = ()
) -> tuple[dict[str, Any], ForceFit]:
    fit = fitted(held_record(rng, held, order), effects)
    return two_witnesses(fit, 1.0, "m"), fit


@pytest.mark.parametrize("order", [0, 1, 2])
def test_both_say_the_same_of_friction_alone(rng: np.random.Generator, order: int) -> None:
    found, fit = heard(rng, order=order)
    scale = 10.0**-order * fit.w0**order
    for witness in (found["loss"], found["shape"]):
        assert witness["mean"] * scale == pytest.approx(FRICTION, abs=4.0 * witness["sd"] * scale)
    assert found["loss"]["sd"] < 0.1 * FRICTION
    # together they know no less than friction does in one column
    joint = 1.0 / np.sqrt(1.0 / found["loss"]["sd"] ** 2 + 1.0 / found["shape"]["sd"] ** 2)
    best = fit.posterior.best
    _, scale2 = fit.posterior.problem.marginals(best, fit.chosen)
    own = np.sqrt(scale2[fit.law.dry_friction]) * fit.regression.scale[fit.law.dry_friction]
    assert joint == pytest.approx(own, rel=0.3)


def test_the_shape_is_deceived_by_held_counts_and_the_loss_is_not(rng: np.random.Generator) -> None:
    found, _ = heard(rng, held=0.5 * FRICTION)
    assert not found["agree"]
    assert found["shape"]["mean"] < 0.7 * FRICTION
    assert found["loss"]["mean"] == pytest.approx(FRICTION, abs=4.0 * found["loss"]["sd"])


def test_hysteresis_in_the_law_takes_most_of_it_away(rng: np.random.Generator) -> None:
    """Nine tenths and more; the rest is the turning points, which the held counts displace too."""
    seed = int(rng.integers(2**32))
    deceived, _ = heard(np.random.default_rng(seed), held=0.5 * FRICTION)
    found, fit = heard(np.random.default_rng(seed), held=0.5 * FRICTION, effects=("sensor_hysteresis",))
    assert fit.sets[fit.chosen] == {"sensor_hysteresis"}
    assert abs(found["shape"]["mean"] - FRICTION) < 0.15 * abs(deceived["shape"]["mean"] - FRICTION)
    assert found["loss"]["mean"] == pytest.approx(FRICTION, abs=4.0 * found["loss"]["sd"])


def test_chance_rarely_sets_them_at_odds(rng: np.random.Generator) -> None:
    """One in a hundred by the normal; of 12 three or more are one in 5,000."""
    assert at_least(10, (heard(rng)[0]["agree"] for _ in range(12)))


def test_the_report_tells_of_both() -> None:
    record = fb.simulate(
        SYSTEM,
        friction=0.02,
        initial_displacement=RELEASE,
        duration=20.0,
        sampling_rate=100.0,
        noise_sd=NOISE,
        seed=1,
        effects={"random_force.sd": 0.006, "random_force.correlation_time": 0.1},
    )
    report = fb.close_loop([record], SYSTEM, seed=1, effects=["random_force", "viscous_damping"])
    witnesses = report.to_dict()["witnesses"]
    for name in ("loss", "shape"):
        low, high = witnesses[name]["interval90"]
        assert low < witnesses[name]["mean"] < high
        assert witnesses[name]["unit"] == "N"
    assert witnesses["agree"] is True
    assert witnesses["loss"]["mean"] == pytest.approx(0.02, rel=0.2)


def test_friction_answers_for_witnesses_that_disagree(rng: np.random.Generator) -> None:
    """Held counts that the law lacks: the loss is right, and friction may be that."""
    record = held_record(rng, 0.1 * FRICTION)
    report = fb.close_loop([record], SYSTEM, seed=1, effects=["random_force"]).to_dict()
    assert report["witnesses"]["agree"] is False
    gap = abs(report["witnesses"]["loss"]["mean"] - report["friction_after"]["mean"])
    assert report["left"]["friction_could_shift_by"] > 0.8 * gap
    low, high = report["friction_after"]["interval90"]
    assert low < SYSTEM.stiffness * FRICTION < high
