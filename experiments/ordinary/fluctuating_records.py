"""Records of a friction that fluctuates, or of a random force in addition to it."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from experiments.ordinary.forced_motion import ForcedMotion, Friction
from experiments.ordinary.loads import (
    ornstein_uhlenbeck_force,
    pink_friction,
    redrawn_friction,
    rough_friction,
    steady_friction,
    telegraph_friction,
)
from experiments.ordinary.recording import Layout, draw_layout, log_uniform, recorded
from experiments.ordinary.rig import SENSORS, OrdinaryRecord, Recipe

__all__ = ["FLUCTUATING"]

_STEPS_A_PERIOD = 400.0
_STEPS_A_CORRELATION_TIME = 8.0


def _friction(kind: str, rng: np.random.Generator, layout: Layout, share: float, step: float) -> Friction:
    level, period = layout.rig.friction, layout.rig.period
    n = math.ceil(layout.end / step) + 2
    if kind == "each half cycle anew":
        # a mass that stops early may take a few more turns than the clock has half cycles
        return redrawn_friction(rng, level, share, math.ceil(2.0 * layout.end / period) + 10)
    if kind == "telegraph":
        return telegraph_friction(rng, level, share, log_uniform(rng, 0.1, 3.0) * period, layout.end)
    if kind == "1/f":
        return pink_friction(rng, level, share, step, n)
    return rough_friction(rng, level, share, log_uniform(rng, 0.1, 1.0) * abs(layout.amplitude))


def _friction_varies(kind: str, rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """By 5 to 60 % of its mean; the sensors in turn."""
    layout = draw_layout(rng)
    share = log_uniform(rng, 0.05, 0.6)
    step = layout.rig.period / _STEPS_A_PERIOD
    friction = _friction(kind, rng, layout, share, step)
    still = np.zeros(math.ceil(layout.end / step) + 2)
    motion = ForcedMotion(layout.rig, friction, still, step, layout.amplitude)
    snr_db = rng.uniform(30.0, 60.0)
    return recorded(rng, layout, motion, SENSORS[replicate % 3], snr_db=snr_db, share=share)


def _random_force(
    half_cycles: tuple[float, float], rng: np.random.Generator, replicate: int
) -> OrdinaryRecord:
    """5 to 50 % of friction, correlated over 0.02 to 1.6 periods; the sensors in turn."""
    layout = draw_layout(rng, half_cycles=half_cycles)
    share, memory = log_uniform(rng, 0.05, 0.5), log_uniform(rng, 0.02, 1.6) * layout.rig.period
    step = min(layout.rig.period / _STEPS_A_PERIOD, memory / _STEPS_A_CORRELATION_TIME)
    n = math.ceil(layout.end / step) + 2
    force = ornstein_uhlenbeck_force(rng, share * layout.rig.friction, memory, step, n)
    motion = ForcedMotion(layout.rig, steady_friction(layout.rig.friction), force, step, layout.amplitude)
    return recorded(
        rng,
        layout,
        motion,
        SENSORS[replicate % 3],
        snr_db=rng.uniform(30.0, 60.0),
        share=share,
        memory=memory / layout.rig.period,
    )


FLUCTUATING: dict[str, Recipe] = {
    **{
        f"friction: {kind}": partial(_friction_varies, kind)
        for kind in ("each half cycle anew", "telegraph", "1/f", "locked to the place")
    },
    "random force": partial(_random_force, (4.0, 60.0)),
    "control: random force, long": partial(_random_force, (20.0, 60.0)),
}
"""By the row of the table."""
