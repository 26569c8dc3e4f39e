"""Derivatives of the motion against differences of SciPy's, of the closed form and of a tight integration."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from friction_bayes.core.arrays import Array
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.core.system import Oscillator, Pendulum
from friction_bayes.mechanics.coulomb import coulomb_decay
from friction_bayes.mechanics.effects import ForceEffect, Scales, force_effects, force_offsets, force_vector
from friction_bayes.mechanics.integrate import DEFAULT_RTOL, propagate, propagate_with_columns
from friction_bayes.mechanics.sensitivities import (
    DISPLACEMENT,
    FRICTION,
    MASS,
    OWN,
    STIFFNESS,
    VELOCITY,
)
from scipy_motion import by_scipy

ROTOR = Oscillator(inertia=0.8, stiffness=9.0)
PENDULUM = Pendulum(inertia=0.8, stiffness=9.0)
DURATION = 9.0
TIME = np.linspace(0.0, DURATION, 1001)
START = 0.4, 0.3
STATE = (DISPLACEMENT, VELOCITY)
LAW = (FRICTION, MASS, STIFFNESS)
EFFECTS = force_effects()

Arguments = list[Any]


def values_of(effect: ForceEffect, system: Oscillator, amplitude: float) -> tuple[float, ...]:
    """Values that its prior thinks ordinary, as any effect has them."""
    scales = Scales(
        system=system,
        quantity=QUANTITIES["angle"],
        amplitude=amplitude,
        duration=DURATION,
        sampling_rate=100.0,
    )
    return tuple(float(prior.distribution.ppf(0.7)) for prior in effect.priors(scales))


def arguments(
    system: Oscillator,
    effects: dict[str, tuple[float, ...]],
    *,
    friction: float = 0.35,
    start: tuple[float, float] = START,
    time: Array = TIME,
    order: int = 0,
) -> Arguments:
    """What ``propagate`` takes."""
    return [
        time,
        *start,
        friction,
        system.moving,
        system.stiffness,
        system.pendulum,
        DURATION,
        force_vector(effects),
        DEFAULT_RTOL,
        order,
    ]


def moved(given: Arguments, number: int, change: float) -> Arguments:
    """The same with one of what derivatives are taken in moved."""
    other = [*given]
    if number < OWN:
        other[1 + number] += change
    else:
        other[8] = given[8].copy()
        other[8][number - OWN] += change
    return other


def value_at(given: Arguments, number: int) -> float:
    return float(given[1 + number] if number < OWN else given[8][number - OWN])


def difference(motion: Callable[[Arguments], Array], given: Arguments, number: int) -> Array:
    """Central differences of sixth order."""
    step = 3e-4 * (abs(value_at(given, number)) or 1.0)
    by = [motion(moved(given, number, k * step)) - motion(moved(given, number, -k * step)) for k in (1, 2, 3)]
    return np.asarray((45.0 * by[0] - 9.0 * by[1] + by[2]) / (60.0 * step))


def tightly(given: Arguments) -> Array:
    """The measured derivative of the motion, integrated to rounding."""
    exact = [*given]
    exact[9] = 1e-13
    return np.asarray(propagate(*exact)[1 + given[10]])


def scipy_motion(given: Arguments) -> Array:
    time, x, v, friction, mass, stiffness, _, duration, p, _, order = given
    offsets = force_offsets()
    terms = [
        (effect.force.py_func, offsets[effect.name])  # type: ignore[attr-defined]
        for effect in EFFECTS
        if p[offsets[effect.name] : offsets[effect.name] + len(effect.parameters)].any()
    ]

    def force(t: float, x: float, v: float, s: float) -> float:
        return (
            stiffness * x
            + friction * s
            + sum(term(t, x, v, s, friction, duration, mass, stiffness, p, i) for term, i in terms)
        )

    return by_scipy(mass, force, x, v, time)[order]


def that_stops(effect: ForceEffect, order: int = 0) -> Arguments:
    """A motion whose last turning point is not on the edge of sticking, where it has no derivative."""
    effects = {effect.name: values_of(effect, ROTOR, 0.4)}
    for friction in (0.35, 0.32, 0.29, 0.26):
        given = arguments(ROTOR, effects, friction=friction, order=order)
        turns = {propagate(*moved(given, FRICTION, way * 0.02 * friction))[4].size for way in (-1, 0, 1)}
        if len(turns) == 1 and propagate(*given)[6] < DURATION:
            return given
    raise AssertionError(f"no motion with {effect.name} stops for good")


def assert_columns(
    given: Arguments,
    numbers: Sequence[int],
    motion: Callable[[Arguments], Array],
    within: float = 1e-7,
) -> None:
    """Compare where no turning point passes the sample between the motions of the differences."""
    computed, columns = propagate_with_columns(*given, np.array(numbers))
    plain = propagate(*given)
    for with_columns, without in zip(computed[:6], plain[:6], strict=True):
        np.testing.assert_array_equal(with_columns, without)
    clear = np.min(np.abs(given[0][:, None] - computed[4]), axis=1) > 0.02
    assert 0.5 < clear.mean() < 1.0
    for number, column in zip(numbers, columns, strict=True):
        expected = difference(motion, given, number)
        assert np.isfinite(column).all()
        largest = np.max(np.abs(expected[clear]))
        assert largest > 0.0
        error = np.max(np.abs(column - expected)[clear]) / largest
        assert error < within, f"column {number} is wrong by {error:.1e} of its largest"


def of_effect(effect: ForceEffect) -> list[int]:
    first = OWN + force_offsets()[effect.name]
    return list(range(first, first + len(effect.parameters)))


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_the_parameters_of_every_force_against_scipy(effect: ForceEffect) -> None:
    given = that_stops(effect)
    assert_columns(given, [FRICTION, *of_effect(effect)], scipy_motion)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_all_columns_of_every_force_and_sensor(effect: ForceEffect, order: int) -> None:
    given = that_stops(effect, order)
    assert_columns(given, [*STATE, *LAW, *of_effect(effect)], tightly)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_all_forces_at_once_on_a_pendulum_at_large_angle(order: int) -> None:
    effects = {effect.name: values_of(effect, PENDULUM, 1.5) for effect in EFFECTS}
    given = arguments(PENDULUM, effects, friction=0.3, start=(1.5, 0.4), order=order)
    assert_columns(given, range(OWN + given[8].size), tightly)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_a_force_that_is_off_has_columns(effect: ForceEffect) -> None:
    """A search wants the derivatives of what it may add, where these have a null."""
    if any(parameter.open_low for parameter in effect.parameters):
        pytest.skip("a parameter that cannot vanish")
    given = arguments(ROTOR, {})
    _, columns = propagate_with_columns(*given, np.array(of_effect(effect)))
    sizes = values_of(effect, ROTOR, 0.4)
    clear = np.min(np.abs(TIME[:, None] - propagate(*given)[4]), axis=1) > 0.02
    for number, column, size in zip(of_effect(effect), columns, sizes, strict=True):
        step = 1e-4 * size
        change = tightly(moved(given, number, step)) - tightly(moved(given, number, -step))
        expected = change / (2.0 * step)
        # of second order, in steps of another size than those of the kernel
        assert np.max(np.abs(column - expected)[clear]) < 1e-5 * np.max(np.abs(expected))


def test_a_hundred_half_cycles_against_the_closed_form() -> None:
    w0 = ROTOR.natural_frequency
    friction = ROTOR.stiffness * 0.5 / 203.0
    time = np.linspace(0.0, 103.0 * math.pi / w0, 4001)
    given = arguments(ROTOR, {}, friction=friction, start=(0.3, 0.4 * w0), time=time)

    def closed_form(given: Arguments) -> Array:
        system = Oscillator(inertia=given[4], stiffness=given[5])
        return coulomb_decay(system, given[3], given[1], given[2], time).displacement

    computed, columns = propagate_with_columns(*given, np.array([*STATE, *LAW]))
    assert math.isfinite(computed[6])
    assert computed[4].size > 100
    for number, column in zip((*STATE, *LAW), columns, strict=True):
        step = 1e-6 * value_at(given, number)
        change = closed_form(moved(given, number, step)) - closed_form(moved(given, number, -step))
        expected = change / (2.0 * step)
        clear = np.min(np.abs(time[:, None] - computed[4]), axis=1) > 1e-3
        error = np.max(np.abs(column - expected)[clear]) / np.max(np.abs(expected))
        # the differences' own error, of second order over 1e-6 of a phase of three hundred
        assert error < 1e-6


def test_a_sample_at_a_turning_point_has_the_derivative_of_what_comes_after() -> None:
    turn = propagate(*arguments(ROTOR, {}))[4][1]
    time = np.array([0.0, turn - 1e-7, turn, turn + 1e-7, DURATION])
    _, (column,) = propagate_with_columns(*arguments(ROTOR, {}, time=time, order=2), np.array([FRICTION]))
    assert column[2] == pytest.approx(column[3], rel=1e-5)
    # dry friction itself jumps there, by twice its size over the inertia
    assert abs(column[2] - column[1]) == pytest.approx(2.0 / ROTOR.moving, rel=1e-5)


def test_a_release_from_rest_and_a_mass_that_sticks_from_the_start() -> None:
    released = arguments(ROTOR, {}, start=(0.4, 0.0))
    assert_columns(released, [DISPLACEMENT, *LAW], tightly)
    for order, expected in enumerate((1.0, 0.0, 0.0)):
        held = arguments(ROTOR, {}, start=(0.01, 0.0), order=order)
        _, columns = propagate_with_columns(*held, np.array([DISPLACEMENT, VELOCITY, FRICTION]))
        np.testing.assert_array_equal(columns[0], expected)
        np.testing.assert_array_equal(columns[1:], 0.0)


def test_break_away_carries_on_from_the_rest() -> None:
    # friction falls to nothing within the record and lets go of what it held
    given = arguments(ROTOR, {"friction_drift": (-2.0,)}, start=(0.05, 0.0), friction=0.5)
    computed, _ = propagate_with_columns(*given, np.array([FRICTION]))
    assert math.isinf(computed[6])
    assert np.ptp(computed[1]) > 0.0
    assert_columns(given, [DISPLACEMENT, *LAW, *of_effect(_named("friction_drift"))], tightly, 1e-6)


def _named(name: str) -> ForceEffect:
    (effect,) = (effect for effect in EFFECTS if effect.name == name)
    return effect
