"""Other forces than a spring and constant dry friction, as columns along a motion."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from eighteen_half_cycles import UNIT
from friction_bayes.estimators.noise.other_forces import (
    FORCES,
    SHAPES,
    falls_faster,
    moved_shapes,
    other_force_columns,
    other_force_sets,
)
from friction_bayes.statespace.kalman import sensor_row
from friction_bayes.statespace.measured_path import MeasuredPath

SYSTEM = fb.Oscillator(mass=2.0, stiffness=800.0)
AMPLITUDE, FRICTION = 0.02, 0.2
SIZES = 4
COLUMNS = (1, 1, 3, 1, 2, 2, 2)
"""Of each force, of one shape and size; friction changes along a line, by one, or a curve, by three."""
END = 6.0
"""Phase at which a decay ends."""


def cosine(cycles: int = 1, amplitude: float = 1.0) -> MeasuredPath:
    phase = np.linspace(0.0, 2.0 * math.pi * cycles, 400 * cycles + 1)
    return MeasuredPath.through(phase, amplitude * np.cos(phase), -amplitude * np.sin(phase))


def test_sets_have_one_size_and_shape_of_each_force_and_two_forces_at_most() -> None:
    sets, log_odds = other_force_sets()
    assert not sets[0].any()
    assert log_odds[0] == 0.0
    columns = other_force_columns(cosine(), sensor_row(0), 0.01, END)
    assert sets.shape[1] == len(columns.names) == columns.scale.size
    names = np.array(columns.names)
    for row in sets:
        held = [int(row[names == name].sum()) for name in FORCES]
        assert sum(count > 0 for count in held) <= 2
        assert all(
            count in (0, wide) or (count, wide) == (1, 3) for count, wide in zip(held, COLUMNS, strict=True)
        )
    assert len(np.unique(sets, axis=0)) == len(sets)
    # most machines have none of them
    assert 1.0 / np.exp(log_odds).sum() > 0.65


def test_without_shapes_the_plain_forces_are_left() -> None:
    sets, _ = other_force_sets(shaped=False)
    columns = other_force_columns(cosine(), sensor_row(0), 0.01, END, ())
    assert sets.shape[1] == len(columns.names) == sum(COLUMNS[:5]) * SIZES
    assert set(columns.names) == set(FORCES[:5])


@pytest.mark.parametrize("amplitude", [1.0, 0.3])
def test_a_loss_of_the_widest_prior_takes_what_friction_alone_would_take(amplitude: float) -> None:
    """Work over a cycle, of damping and drag: a coefficient of one sd of the widest prior takes all of it."""
    path, friction = cosine(amplitude=amplitude), 0.01
    columns = other_force_columns(path, sensor_row(0), friction, END)
    for name, power in ((FORCES[0], 1), (FORCES[1], 2)):
        size = columns.scale[columns.names.index(name)]
        work = size * float(np.trapezoid(np.abs(path.v) ** (power + 1), path.phase))
        assert work == pytest.approx(4.0 * friction * amplitude, rel=1e-3)


@pytest.mark.parametrize(("force", "moved"), [(5, 1.1), (6, 0.9)])
def test_a_shape_moves_to_where_it_explains_the_force(force: int, moved: float) -> None:
    """A force of a slightly other speed or length is that of a column and its derivative."""
    path, row = cosine(cycles=3), sensor_row(0)
    true = tuple(moved * value for value in SHAPES)
    names = np.array(other_force_columns(path, row, 0.01, END).names)
    other, at = other_force_columns(path, row, 0.01, END, true), other_force_columns(path, row, 0.01, END)
    # the second of four shapes, its first size
    mine = np.flatnonzero(names == FORCES[force])[[2 * SIZES, 3 * SIZES]]
    coefficients = np.linalg.lstsq(at.sensor[:, mine], other.sensor[:, mine[0]], rcond=None)[0]
    law = np.zeros(len(names))
    law[mine] = coefficients
    found = np.array(moved_shapes(law, SHAPES))
    shape = (force - 5) * 4 + 1
    assert found[shape] == pytest.approx(true[shape], rel=0.03)
    assert np.array_equal(np.delete(found, shape), np.delete(SHAPES, shape))


@pytest.mark.parametrize(
    ("shares", "faster"),
    [
        ({0: 0.1}, True),
        ({5: 0.1}, False),
        ({2: 0.1}, False),
        ({2: -0.1}, True),
        ({0: 0.1, 5: 0.3}, False),
        ({0: 0.3, 5: 0.1}, True),
        ({0: 0.1, 2: 0.3}, False),
    ],
)
def test_the_amplitude_falls_by_what_the_larger_loss_does(shares: dict[int, float], faster: bool) -> None:
    """Of damping, Stribeck friction, and friction that grows or falls with time; whatever the prior sd."""
    columns = other_force_columns(cosine(), sensor_row(0), 0.01, END)
    for size in range(SIZES):
        law = np.zeros(columns.scale.size)
        for force, share in shares.items():
            first = columns.names.index(FORCES[force])
            law[first + size] = share * columns.scale[first : first + SIZES].max()
        assert falls_faster(columns.names, law, columns.scale) is faster


RECORDS = {
    "damping": {"viscous_damping.damping_ratio": 0.004},
    "drag": {"quadratic_drag.drag_coefficient": 4.0},
    "drift": {"friction_drift.relative_change": 0.4},
    "curved drift": {"curved_friction_drift.relative_change": 0.3, "curved_friction_drift.time_share": 0.4},
    "bent spring": {"cubic_stiffness.cubic_stiffness": 0.03 * 800.0 / 0.02**2},
    "Stribeck": {"stribeck_friction.static_excess": 0.5, "stribeck_friction.stribeck_velocity": 0.06},
    "pre-sliding": {"presliding.displacement": 3e-4},
    "damping, Stribeck": {
        "viscous_damping.damping_ratio": 0.004,
        "stribeck_friction.static_excess": 0.5,
        "stribeck_friction.stribeck_velocity": 0.06,
    },
}


def decay(quantity: str, noise_sd: float, effects: dict[str, float], seed: int) -> xr.DataArray:
    return fb.simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=AMPLITUDE,
        duration=5.0,
        sampling_rate=400.0,
        quantity=quantity,
        noise_sd=noise_sd,
        seed=seed,
        effects=effects,
    )


@pytest.mark.parametrize(
    ("effects", "quantity"),
    [
        ("damping", "displacement"),
        ("damping", "acceleration"),
        ("drag", "velocity"),
        ("drift", "displacement"),
        ("drift", "acceleration"),
        ("curved drift", "velocity"),
        ("bent spring", "displacement"),
        ("bent spring", "acceleration"),
        ("Stribeck", "velocity"),
        ("Stribeck", "acceleration"),
        ("pre-sliding", "displacement"),
        ("pre-sliding", "acceleration"),
        ("damping, Stribeck", "displacement"),
    ],
)
def test_friction_is_right_under_each_force(effects: str, quantity: str) -> None:
    """Within 98 % of its interval, which is narrow; the fit that is drawn leaves noise but at the corners."""
    scale = UNIT[quantity]
    record = decay(quantity, 2e-5 * scale, RECORDS[effects], seed=3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.RecordWarning)
        found = fb.estimate(record, SYSTEM)
    low, high = found.friction.interval(0.98)
    assert low < FRICTION < high
    assert high - low < 0.06 * FRICTION
    assert found.random_force.probability < 0.01
    left = np.abs(found.decay.values - found.fit.prediction)
    assert np.median(left[: left.size // 2]) == pytest.approx(0.6745 * 2e-5 * scale, rel=0.1)


@pytest.mark.parametrize("quantity", UNIT)
def test_a_bent_scale_is_straightened(quantity: str) -> None:
    """One side reads 2 % too long, and both ends 1 % too short: neither is a force that fluctuates."""
    largest = AMPLITUDE * UNIT[quantity]
    bent = {
        "sensor_nonlinearity.curvature": 0.02 / largest,
        "sensor_nonlinearity.cubic": -0.01 / largest**2,
    }
    record = decay(quantity, 1e-3 * largest, bent, seed=2)
    found = fb.estimate(record, SYSTEM)
    low, high = found.friction.interval(0.98)
    assert low < FRICTION < high < low + 0.01 * FRICTION
    assert found.random_force.probability < 0.01
    assert found.fit.bent("sensor_nonlinearity")[0] > 0.99
    assert any("the scale of the sensor is bent" in note for note in found.notes)


def test_a_law_with_a_random_force_draws_the_fit_of_dry_friction() -> None:
    """Alone it would wander off by what the force does: it leaves no more than that fit."""
    record = fb.simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=AMPLITUDE,
        duration=3.0,
        sampling_rate=400.0,
        noise_sd=2e-5,
        seed=3,
        effects={
            "viscous_damping.damping_ratio": 0.006,
            "random_force.sd": 0.2 * FRICTION,
            "random_force.correlation_time": 0.2,
        },
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.RecordWarning)
        found, plain = fb.estimate(record, SYSTEM), fb.estimate(record, SYSTEM, random_force="none")
    assert sum(each.probability for each in found.fit.accounts if each.forced and each.others) > 0.5
    assert np.array_equal(found.fit.prediction, plain.fit.prediction)
