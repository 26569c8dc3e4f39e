"""Records of a motion that more than constant dry friction resists: damping, drag, other laws of friction."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from experiments.ordinary.recording import Layout, draw_layout, log_uniform, recorded
from experiments.ordinary.resisted_motion import ResistedMotion
from experiments.ordinary.rig import SENSORS, OrdinaryRecord, Recipe

__all__ = ["RESISTED"]

_KINDS = (
    "viscous damping",
    "quadratic drag",
    "friction that changes",
    "Stribeck friction",
    "pre-sliding",
)


class _Law(NamedTuple):
    """Resistance [N] by time, speed and way from the last turning point; dry friction by time; what holds."""

    resistance: Callable[[float, float, float], float]
    dry: Callable[[float], float]
    static: float
    """The least force that moves a mass at rest, over dry friction."""


def _law(kind: str, rng: np.random.Generator, layout: Layout, share: float) -> _Law:
    friction, amplitude = layout.rig.friction, abs(layout.amplitude)
    # of a cycle in the middle of the decay: friction takes 4 r a, damping pi c a v, drag 8/3 c a v**2
    speed = 0.5 * amplitude * layout.rig.frequency
    rest = (1.0 - share) * friction
    if kind == "viscous damping":
        damping = share * 4.0 * friction / (math.pi * speed)
        return _Law(lambda t, v, s: rest + damping * v, lambda t: rest, 1.0)
    if kind == "quadratic drag":
        drag = share * 1.5 * friction / speed**2
        return _Law(lambda t, v, s: rest + drag * v * v, lambda t: rest, 1.0)
    if kind == "friction that changes":
        change = share * float(rng.choice([-1.0, 1.0])) / layout.end
        level = partial(_changing, friction, change, 0.5 * layout.end)
        return _Law(lambda t, v, s: level(t), level, 1.0)
    if kind == "Stribeck friction":
        excess, slow = rng.uniform(0.2, 1.0), log_uniform(rng, 0.1, 0.8) * speed
        least = friction / (1.0 + 0.5 * excess)
        return _Law(
            lambda t, v, s: least * (1.0 + excess * math.exp(-((v / slow) ** 2))),
            lambda t: least,
            1.0 + excess,
        )
    length = log_uniform(rng, 0.005, 0.04) * amplitude
    return _Law(lambda t, v, s: friction * (1.0 - 2.0 * math.exp(-s / length)), lambda t: friction, 1.0)


def _changing(mean: float, change: float, middle: float, time: float) -> float:
    return mean * (1.0 + change * (time - middle))


def _resisted(kind: str, rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """8 to 60 half cycles at 30 to 60 dB; the sensors in turn.

    Damping and drag take 3 to 60 % of what dry friction alone would take; friction changes by as much from
    the first sample to the last. Static friction exceeds the other by 20 to 100 %, up to a tenth to eight
    tenths of half the largest speed; a contact springs over 0.5 to 4 % of the amplitude.
    """
    layout = draw_layout(rng, half_cycles=(8.0, 60.0))
    share = log_uniform(rng, 0.03, 0.6)
    law = _law(kind, rng, layout, share)
    motion = ResistedMotion(
        layout.rig,
        law.resistance,
        lambda t: law.static * law.dry(t),
        lambda start, stop: law.dry(0.5 * (start + stop)),
        layout.amplitude,
        layout.end,
    )
    return recorded(rng, layout, motion, SENSORS[replicate % 3], snr_db=rng.uniform(30.0, 60.0), share=share)


RESISTED: dict[str, Recipe] = {f"resisted: {kind}": partial(_resisted, kind) for kind in _KINDS}
"""By the row of the table."""
