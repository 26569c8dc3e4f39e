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
    pull: Callable[[float], float] = lambda x: 0.0,
    rub: Callable[[float], float] = lambda x: 1.0,
    knock: Callable[[float], float] = lambda t: 0.0,
) -> dict[int, np.ndarray]:
    """Motion at ``step`` by order of derivative, until the mass sticks.

    Friction, the force's sd and what else pulls at a position, or knocks at a time, are lengths, over the
    stiffness; friction is ``rub`` times as large at a position. These forces are held over each fine step,
    and the motion there is a rotation about where their sum would hold the mass.
    """
    turn = frequency * step / oversampling
    memory = math.exp(-step / oversampling / correlation_time)
    kicks = rng.standard_normal(samples * oversampling)
    x, v, sign = release, 0.0, -1.0
    wandering = force_sd * rng.standard_normal()
    rows = []
    for i in range(samples * oversampling):
        if i % oversampling == 0:
            rows.append(
                (x, v, wandering + pull(x) + knock(i * step / oversampling) - friction * rub(x) * sign - x)
            )
        left = turn
        # at the middle of the step, so that holding it takes no energy out
        middle = x + 0.5 * turn * v
        force, level = wandering + pull(middle) + knock(i * step / oversampling), friction * rub(middle)
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
        wandering = memory * wandering + force_sd * math.sqrt(1.0 - memory**2) * kicks[i]
    return _columns(rows, frequency)


def _columns(rows: list, frequency: float) -> dict[int, np.ndarray]:
    return {order: column * frequency**order for order, column in enumerate(np.array(rows).T)}
