"""The shape of a force that the law of a record leaves."""

from __future__ import annotations

import math

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.loop.checks import force_tests
from friction_bayes.loop.checks.force_tests import what_is_left
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.record_fit import ForceFit, fit_random_force

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)


def fitted(effects: dict[str, float], seed: int) -> ForceFit:
    """A record with effects that are not evaluated."""
    record = fb.simulate(
        SYSTEM,
        friction=0.3,
        initial_displacement=0.02,
        duration=10.0,
        sampling_rate=200.0,
        effects=effects,
        noise_sd=1e-5,
        seed=seed,
    )
    (segment,) = cut_records([record], SYSTEM)
    # a filter rounds turning points too, and none is known to be there
    fit = fit_random_force(segment, SYSTEM, ["random_force"], noise="white")
    assert fit is not None
    return fit


@pytest.mark.parametrize(
    ("effects", "shape"),
    [
        ({"quadratic_drag.drag_coefficient": 15.0}, "a force proportional to the square of the velocity"),
        ({"viscous_damping.damping_ratio": 0.01}, "a force proportional to the velocity"),
        ({"presliding.displacement": 1e-3}, "a pulse after each turning point"),
    ],
)
def test_the_shape_is_that_of_the_effect_that_was_left_out(
    effects: dict[str, float], shape: str, seed: int
) -> None:
    left = what_is_left(fitted(effects, seed))
    assert left.shape is not None
    assert left.shape.name == shape
    assert left.shape.share > 0.8


def test_nothing_left_has_no_shape(seed: int) -> None:
    left = what_is_left(fitted({}, seed))
    # the tests fail together in one record of a hundred
    assert left.worst is None
    assert left.shape is None


def test_a_law_that_has_taken_every_shape_leaves_none(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """As one does whose sensor errs with the angle: two measured swings of it together stopped the loop."""
    fit = fitted({}, seed)
    sign = fit.path.direction
    monkeypatch.setattr(force_tests, "_shapes", lambda _: [("dry friction", sign)])
    assert (
        force_tests.best_shape(fit, np.stack([np.maximum(sign, 0.0), np.minimum(sign, 0.0)], axis=1)) is None
    )


@pytest.mark.parametrize("clipped", [0.0, 0.5])
def test_a_line_near_the_motion_stays_there_where_the_sensor_is_clipped(
    clipped: float, rng: np.random.Generator
) -> None:
    """Samples that are set aside take their time: moved together, the rest would show it at twice as much."""
    fit = fitted({}, 1)
    angle = fit.w0 * fit.segment.time[: fit.record.samples]
    used = np.abs(np.cos(angle)) < math.cos(0.5 * math.pi * clipped) + 1e-9
    left = rng.standard_normal(angle.size) + np.sin(1.2 * angle)
    without = fit.on(fit.record.setting_aside(~used))
    assert force_tests._near_motion(without, left[used]) > 2.0
    assert force_tests._near_motion(without, (left - np.sin(1.2 * angle))[used]) < 1.1
