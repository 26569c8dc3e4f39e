"""Columns about a law are the derivatives of its motion, as the simulation has them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.core.arrays import Array
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.loop.columns.law_columns import LawBefore, LawColumns, law_columns
from friction_bayes.mechanics.effects import Scales
from friction_bayes.mechanics.integrate import integrate
from friction_bayes.mechanics.motion import Motion
from friction_bayes.statespace.measured_path import MeasuredPath
from moving import moving_record, shape_of

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)
W0, DURATION, RATE = SYSTEM.natural_frequency, 5.0, 200.0
TIME = np.arange(round(DURATION * RATE)) / RATE
FRICTION, RELEASE = 0.5, 0.02
SPEED = -0.3 * W0 * RELEASE
LAWS = {
    "viscous_damping": ("damping_ratio", 0.01),
    "quadratic_drag": ("drag_coefficient", 5.0),
    "asymmetric_friction": ("asymmetry", 0.3),
    "friction_drift": ("relative_change", 0.6),
    "curved_friction_drift": ("relative_change", 0.6),
    "cubic_stiffness": ("cubic_stiffness", 2e5),
    "stiffness_drift": ("relative_change", 0.02),
    "stribeck_friction": ("static_excess", 0.5),
}
CLOSE, SHARP = 1e-4, 3e-3
"""Of the largest derivative, at 31 samples a period; a force that changes within two samples is coarser."""


@pytest.mark.parametrize("quantity", ["displacement", "velocity"])
@pytest.mark.parametrize("name", list(LAWS))
def test_columns_are_the_derivatives_of_the_simulated_motion(name: str, quantity: str) -> None:
    order = QUANTITIES[quantity].order
    scales = Scales(
        system=SYSTEM,
        quantity=QUANTITIES[quantity],
        amplitude=RELEASE,
        duration=DURATION,
        sampling_rate=RATE,
    )
    record, assumed = moving_record(scales, name), 1.1 * FRICTION / SYSTEM.stiffness

    def along(x: Array, v: Array, about: LawBefore | None = None) -> LawColumns:
        path = MeasuredPath.through(W0 * TIME, x, v / W0)
        return law_columns(path, record, w0=W0, friction=assumed, about=about)

    still = along(RELEASE * np.cos(W0 * TIME), -W0 * RELEASE * np.sin(W0 * TIME))
    shapes = still.alternatives(name)
    chosen = shapes[len(shapes) // 2][0]
    column, (parameter, value) = still.columns[chosen], LAWS[name]
    shape = shape_of(column, scales)

    def motion(size: float = 1.0, friction: float = FRICTION, x: float = RELEASE, v: float = SPEED) -> Motion:
        """At the size of the coefficient over that of the law, which may be the parameter times friction."""
        scaled = value * size * (FRICTION / friction if column.of_friction else 1.0)
        effects = {f"{name}.{key}": each for key, each in (shape | {parameter: scaled}).items()}
        return integrate(SYSTEM, friction, x, v, TIME, effects, duration=DURATION)

    def derivative(changed: Callable[[float], Motion], h: float) -> Array:
        """By central differences of what the sensor shows, natural units."""
        above, below = ([each.displacement, each.velocity][order] for each in (changed(h), changed(-h)))
        return np.asarray((above - below) / (2.0 * h * W0**order))

    law = motion()
    plain = along(law.displacement, law.velocity)
    coefficients = np.zeros(len(plain.columns))
    coefficients[plain.dry_friction] = FRICTION / SYSTEM.stiffness
    coefficients[chosen] = value * (FRICTION / plain.friction if column.of_friction else 1.0)
    columns = along(law.displacement, law.velocity, plain.before(coefficients, np.zeros(TIME.size)))
    assert columns.about is not None
    expected = {
        0: derivative(lambda h: motion(x=RELEASE + h), 1e-6 * RELEASE),
        1: derivative(lambda h: motion(v=SPEED + W0 * h), 1e-6 * RELEASE),
        plain.dry_friction: derivative(lambda h: motion(friction=FRICTION + h), 1e-5 * FRICTION)
        * SYSTEM.stiffness,
        chosen: derivative(lambda h: motion(size=1.0 + h), 1e-5) / coefficients[chosen],
    }
    moving = min(law.stop_time, DURATION) - 0.3 > TIME
    assert moving.sum() > 500
    for j, exact in expected.items():
        off = np.max(np.abs(columns.sensor[:, j] - exact)[moving]) / np.max(np.abs(exact[moving]))
        assert off < (SHARP if name == "stribeck_friction" else CLOSE), columns.columns[j]
