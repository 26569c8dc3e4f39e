"""Free decay under a resistance of any kind, by Runge-Kutta steps that end at turning points.

``m x'' + k x = -R(t, v, s) sign(v)``: the resistance depends on time, speed and the way from the last turning
point. A mass whose pull does not exceed what holds it at a turning point stays there.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from experiments.ordinary.rig import Rig

__all__ = ["ResistedMotion"]

_BISECTIONS = 45
_STEPS_A_PERIOD = 400.0


class ResistedMotion:
    """Motion from a release at rest at time 0.

    Parameters
    ----------
    rig : Rig
        Its friction is not used.
    resistance : callable (time [s], speed [m/s], way [m]) -> float
        Opposite to the motion [N].
    held : callable (time [s]) -> float
        The least force that moves a mass at rest [N].
    friction : callable (start, stop) -> float
        Mean dry friction between two times, which is to be estimated [N].
    displacement : float
        At time 0 [m].
    duration : float
        [s].
    """

    def __init__(
        self,
        rig: Rig,
        resistance: Callable[[float, float, float], float],
        held: Callable[[float], float],
        friction: Callable[[float, float], float],
        displacement: float,
        duration: float,
    ) -> None:
        self._rig, self._resistance, self._friction = rig, resistance, friction
        step = rig.period / _STEPS_A_PERIOD
        t, x, v = 0.0, displacement, 0.0
        sign, turned = -math.copysign(1.0, x), x
        states = [(t, x, v, sign, turned)]
        while t < duration and sign != 0.0:
            h = step
            after = self._advance(t, x, v, sign, turned, h)
            if after[1] * sign < 0.0:
                h = self._until_turning(t, x, v, sign, turned, h)
                x, v = self._advance(t, x, v, sign, turned, h)[0], 0.0
                t, turned = t + h, x
                pulls = rig.stiffness * abs(x) > held(t)
                sign = -math.copysign(1.0, x) if pulls else 0.0
            else:
                t, (x, v) = t + h, after
            states.append((t, x, v, sign, turned))
        if sign == 0.0:
            states.append((max(duration, t) + step, x, 0.0, 0.0, turned))
        self._t, self._x, self._v, self._sign, self._turned = np.array(states).T

    def _acceleration(self, t: float, x: float, v: float, sign: float, turned: float) -> float:
        resisted = self._resistance(t, abs(v), abs(x - turned))
        return -(self._rig.stiffness * x + sign * resisted) / self._rig.mass

    def _advance(
        self, t: float, x: float, v: float, sign: float, turned: float, h: float
    ) -> tuple[float, float]:
        """One Runge-Kutta step of fourth order: displacement and velocity after ``h``."""
        a1 = self._acceleration(t, x, v, sign, turned)
        x2, v2 = x + 0.5 * h * v, v + 0.5 * h * a1
        a2 = self._acceleration(t + 0.5 * h, x2, v2, sign, turned)
        x3, v3 = x + 0.5 * h * v2, v + 0.5 * h * a2
        a3 = self._acceleration(t + 0.5 * h, x3, v3, sign, turned)
        x4, v4 = x + h * v3, v + h * a3
        a4 = self._acceleration(t + h, x4, v4, sign, turned)
        return x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)

    def _until_turning(self, t: float, x: float, v: float, sign: float, turned: float, h: float) -> float:
        """Part of a step after which the velocity is zero."""
        low, high = 0.0, h
        for _ in range(_BISECTIONS):
            h = 0.5 * (low + high)
            if self._advance(t, x, v, sign, turned, h)[1] * sign > 0.0:
                low = h
            else:
                high = h
        return high

    def sample(self, times: NDArray[np.float64], quantity: str) -> NDArray[np.float64]:
        """Displacement [m], velocity [m/s] or acceleration [m/s2] at ``times`` [s]; held before the release.

        Cubic between the ends of a step; the acceleration is that of the equation of motion there.
        """
        curve = CubicHermiteSpline(self._t, self._x, self._v)
        owner = np.clip(np.searchsorted(self._t, times, side="right") - 1, 0, self._t.size - 2)
        inside = np.clip(times, 0.0, self._t[-1])
        x, v, moves = curve(inside), curve(inside, 1), (times >= 0.0) & (self._sign[owner] != 0.0)
        if quantity == "displacement":
            return np.asarray(x)
        if quantity == "velocity":
            return np.where(moves, v, 0.0)
        there = zip(inside, x, v, self._sign[owner], self._turned[owner], strict=True)
        return np.where(moves, [self._acceleration(*(float(each) for each in state)) for state in there], 0.0)

    def mean_friction(self, start: float, stop: float) -> float:
        """Mean dry friction from ``start`` to ``stop`` [s after the release] [N]."""
        return self._friction(start, stop)
