"""Losses beside constant dry friction, as columns along a motion."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.estimators.noise.other_losses import (
    LOSSES,
    SHAPES,
    loss_columns,
    loss_sets,
    moved_shapes,
)
from friction_bayes.statespace.kalman import sensor_row
from friction_bayes.statespace.measured_path import MeasuredPath

SYSTEM = fb.Oscillator(mass=2.0, stiffness=800.0)
AMPLITUDE, FRICTION = 0.02, 0.2
SIZES = 4
END = 6.0
"""Phase at which a decay ends."""


def cosine(cycles: int = 1, amplitude: float = 1.0) -> MeasuredPath:
    phase = np.linspace(0.0, 2.0 * math.pi * cycles, 400 * cycles + 1)
    return MeasuredPath.through(phase, amplitude * np.cos(phase), -amplitude * np.sin(phase))


def test_sets_have_one_size_and_shape_of_each_loss_and_two_losses_at_most() -> None:
    sets, log_odds = loss_sets()
    assert not sets[0].any()
    assert log_odds[0] == 0.0
    columns = loss_columns(cosine(), sensor_row(0), 0.01, END)
    assert sets.shape[1] == len(columns.names) == columns.scale.size
    names = np.array(columns.names)
    for row in sets:
        held = {name: int(row[names == name].sum()) for name in LOSSES}
        assert sum(count > 0 for count in held.values()) <= 2
        assert all(held[name] in (0, 1) for name in LOSSES[:3])
        assert all(held[name] in (0, 2) for name in LOSSES[3:])
    assert len(np.unique(sets, axis=0)) == len(sets)
    # most machines have none of them
    assert 1.0 / np.exp(log_odds).sum() > 0.7


def test_without_shapes_the_plain_losses_are_left() -> None:
    sets, _ = loss_sets(shaped=False)
    columns = loss_columns(cosine(), sensor_row(0), 0.01, END, ())
    assert sets.shape[1] == len(columns.names) == 3 * SIZES
    assert set(columns.names) == set(LOSSES[:3])


@pytest.mark.parametrize("amplitude", [1.0, 0.3])
def test_a_loss_of_the_widest_prior_takes_what_friction_alone_would_take(amplitude: float) -> None:
    """Work over a cycle, of damping and drag: a coefficient of one sd of the widest prior takes all of it."""
    path, friction = cosine(amplitude=amplitude), 0.01
    columns = loss_columns(path, sensor_row(0), friction, END)
    for name, power in ((LOSSES[0], 1), (LOSSES[1], 2)):
        size = columns.scale[columns.names.index(name)]
        work = size * float(np.trapezoid(np.abs(path.v) ** (power + 1), path.phase))
        assert work == pytest.approx(4.0 * friction * amplitude, rel=1e-3)


@pytest.mark.parametrize(("loss", "moved"), [(3, 1.1), (4, 0.9)])
def test_a_shape_moves_to_where_it_explains_the_force(loss: int, moved: float) -> None:
    """A force of a slightly other speed or length is that of a column and its derivative."""
    path, row = cosine(cycles=3), sensor_row(0)
    true = tuple(moved * value for value in SHAPES)
    names = np.array(loss_columns(path, row, 0.01, END).names)
    other, at = loss_columns(path, row, 0.01, END, true), loss_columns(path, row, 0.01, END)
    # the second of four shapes, its first size
    mine = np.flatnonzero(names == LOSSES[loss])[[2 * SIZES, 3 * SIZES]]
    coefficients = np.linalg.lstsq(at.sensor[:, mine], other.sensor[:, mine[0]], rcond=None)[0]
    law = np.zeros(len(names))
    law[mine] = coefficients
    found = np.array(moved_shapes(law, SHAPES))
    shape = (loss - 3) * 4 + 1
    assert found[shape] == pytest.approx(true[shape], rel=0.03)
    assert np.array_equal(np.delete(found, shape), np.delete(SHAPES, shape))


RECORDS = {
    "damping": {"viscous_damping.damping_ratio": 0.004},
    "drag": {"quadratic_drag.drag_coefficient": 4.0},
    "drift": {"friction_drift.relative_change": 0.4},
    "Stribeck": {"stribeck_friction.static_excess": 0.5, "stribeck_friction.stribeck_velocity": 0.06},
    "pre-sliding": {"presliding.displacement": 3e-4},
    "damping, Stribeck": {
        "viscous_damping.damping_ratio": 0.004,
        "stribeck_friction.static_excess": 0.5,
        "stribeck_friction.stribeck_velocity": 0.06,
    },
}


@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
@pytest.mark.parametrize("effects", RECORDS.values(), ids=RECORDS)
def test_friction_is_right_under_each_loss(effects: dict[str, float], quantity: str) -> None:
    """Within 98 % of its interval, which is narrow; the fit that is drawn leaves noise but at the corners."""
    scale = 20.0 ** ("displacement", "velocity", "acceleration").index(quantity)
    record = fb.simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=AMPLITUDE,
        duration=5.0,
        sampling_rate=400.0,
        quantity=quantity,
        noise_sd=2e-5 * scale,
        seed=3,
        effects=effects,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.RecordWarning)
        found = fb.estimate(record, SYSTEM)
    low, high = found.friction.interval(0.98)
    assert low < FRICTION < high
    assert high - low < 0.06 * FRICTION
    assert found.random_force.probability < 0.01
    left = np.abs(found.decay.values - found.fit.prediction)
    assert np.median(left[: left.size // 2]) == pytest.approx(0.6745 * 2e-5 * scale, rel=0.1)
