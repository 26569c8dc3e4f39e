"""Decays under dry friction and a fluctuating force; shares no code with the package."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np


def fluctuating_decay(
    rng: np.random.Generator,
    *,
    frequency: float,
    friction: float,
    release: float,
    step: float,
    samples: int,
    force_sd: float = 0.0,
    correlation_time: float = 1.0,
    oversampling: int = 4,
    pull: Callable[[float], float] | None = None,
    rub: Callable[[float], float] | None = None,
    knock: Callable[[float], float] | None = None,
) -> dict[int, np.ndarray]:
    """Motion at ``step`` by order of derivative, until the mass sticks.

    Friction, the force's sd and what else pulls at a position, or knocks at a time, are lengths, over the
    stiffness; friction is ``rub`` times as large at a position. These forces are held over each fine step,
    and the motion there is a rotation about where their sum would hold the mass.
    """
    turn = frequency * step / oversampling
    whole_cosine, whole_sine = math.cos(turn), math.sin(turn)
    memory = math.exp(-step / oversampling / correlation_time)
    kicks = (force_sd * math.sqrt(1.0 - memory**2) * rng.standard_normal(samples * oversampling)).tolist()
    x, v, sign = release, 0.0, -1.0
    wandering = force_sd * rng.standard_normal()
    rows = []
    for i, kick in enumerate(kicks):
        # what does not act is not called: most records have none of the three
        outer = wandering if knock is None else wandering + knock(i * step / oversampling)
        if i % oversampling == 0:
            pulled = outer if pull is None else outer + pull(x)
            rows.append((x, v, pulled - (friction if rub is None else friction * rub(x)) * sign - x))
        # at the middle of the step, so that holding it takes no energy out
        middle = x + 0.5 * turn * v
        force = outer if pull is None else outer + pull(middle)
        level = friction if rub is None else friction * rub(middle)
        wandering = memory * wandering + kick
        left = turn
        # nearly every step is this one: it goes on in its direction, and there is no turn to look for
        centre = force - level * sign
        new_v = v * whole_cosine - (x - centre) * whole_sine
        if new_v * sign > 1e-9 * release and v * sign > 1e-9 * release:
            x, v = centre + (x - centre) * whole_cosine + v * whole_sine, new_v
            continue
        while left > 0.0:
            centre = force - level * sign
            until = math.atan2(v, x - centre)
            until = until % math.pi if abs(v) > 1e-12 * release else math.pi
            part = min(left, until)
            cosine, sine = math.cos(part), math.sin(part)
            x, v = centre + (x - centre) * cosine + v * sine, v * cosine - (x - centre) * sine
            left -= part
            if part == until:
                v = 0.0
                if abs(force - x) <= level:
                    return _columns(rows, frequency)
                sign = math.copysign(1.0, force - x)
    return _columns(rows, frequency)


def _columns(rows: list, frequency: float) -> dict[int, np.ndarray]:
    return {order: column * frequency**order for order, column in enumerate(np.array(rows).T)}
