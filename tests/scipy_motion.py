"""A free decay by SciPy, half cycle by half cycle: the reference of the integrator and of its derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from friction_bayes.core.arrays import Array


def by_scipy(
    mass: float,
    force: Callable[[float, float, float, float], float],
    displacement: float,
    velocity: float,
    time: Array,
) -> Array:
    """Displacement and velocity, shape (2, n): DOP853 from one velocity zero to the next.

    ``force(t, x, v, s)`` is the whole force while the motion goes in direction ``s``.
    """
    t, state, end = time[0], [displacement, velocity], time[-1]
    out = np.full((2, time.size), np.nan)
    while True:
        if state[1] == 0.0:
            moves = [s for s in (-1.0, 1.0) if -s * force(t, state[0], 0.0, s) > 0.0]
            if not moves:
                out[:, time >= t] = [[state[0]], [0.0]]
                return out
            s = moves[0]
        else:
            s = math.copysign(1.0, state[1])

        def slope(t: float, y: Array, s: float = s) -> list[float]:
            return [y[1], -force(t, y[0], y[1], s) / mass]

        def reversal(t: float, y: Array, s: float = s, start: float = t) -> float:
            return s * y[1] if t > start + 1e-6 else 1.0

        reversal.terminal = True  # type: ignore[attr-defined]
        part = solve_ivp(
            slope,
            (t, end),
            state,
            method="DOP853",
            dense_output=True,
            events=reversal,
            rtol=3e-14,
            atol=1e-15,
        )
        covered = (time >= t) & (time <= part.t[-1])
        out[:, covered] = part.sol(time[covered])
        if part.status == 0:
            return out
        t, state = part.t_events[0][0], [part.y_events[0][0][0], 0.0]
