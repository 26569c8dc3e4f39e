"""Motion under any friction and any force, by Runge-Kutta steps that end at turning points.

``m x'' + r(t, x, n) sign(x') + k x = f(t)``: the force is given on a grid and linear between its points, the
friction is a function of time, place and half cycle. A mass whose pull does not exceed its friction sticks
until a point of the grid where it does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.ordinary.rig import Rig

__all__ = ["ForcedMotion", "Friction"]

Friction = Callable[[float, float, int], float]
"""Friction force [N] by time [s], displacement [m] and the number of the half cycle."""

_BISECTIONS = 45


class _Piece(NamedTuple):
    """A step within one direction of motion: ends in time, displacement, velocity, force and friction."""

    t0: float
    t1: float
    x0: float
    x1: float
    v0: float
    v1: float
    f0: float
    f1: float
    r0: float
    r1: float
    sign: float


class ForcedMotion:
    """Solution from a start at time 0 until the force ends; held at the start before.

    Parameters
    ----------
    rig : Rig
        Its friction is not used.
    friction : callable
        As :data:`Friction`.
    force : ndarray, shape (n,)
        On the mass, at times ``step * arange(n)`` [N].
    step : float
        Of the integration too [s]; a few hundred in a period and a good many in what acts.
    displacement : float
        At time 0, where the mass is at rest [m].

    Attributes
    ----------
    turning_times : ndarray
        When the velocity passed through zero [s].
    """

    def __init__(
        self, rig: Rig, friction: Friction, force: NDArray[np.float64], step: float, displacement: float
    ) -> None:
        self._rig, self._friction = rig, friction
        self._half_cycle = 0
        pieces: list[_Piece] = []
        turns: list[float] = []
        path = force.tolist()
        x, v, sign = displacement, 0.0, 0.0
        for i in range(len(path) - 1):
            t, end = step * i, step * (i + 1)
            slope = (path[i + 1] - path[i]) / step
            f = path[i]
            if sign == 0.0:
                sign = self._direction(t, x, f)
            while end - t > 1e-9 * step:
                piece, turned = self._piece(t, end, x, v, sign, f, slope)
                pieces.append(piece)
                t, x, v, f = piece.t1, piece.x1, piece.v1, piece.f1
                if turned:
                    turns.append(t)
                    self._half_cycle += 1
                    sign = self._direction(t, x, f)
        # ends of all pieces by name, shape (n,) each
        self._pieces = dict(zip(_Piece._fields, np.array(pieces).T, strict=True))
        self.turning_times: NDArray[np.float64] = np.array(turns)
        travel = np.abs(self._pieces["x1"] - self._pieces["x0"])
        work = 0.5 * (self._pieces["r0"] + self._pieces["r1"]) * travel
        self._ends = np.append(self._pieces["t0"], self._pieces["t1"][-1])
        self._travel = np.concatenate(([0.0], np.cumsum(travel)))
        self._work = np.concatenate(([0.0], np.cumsum(work)))

    def _direction(self, t: float, x: float, f: float) -> float:
        """Where a mass at rest goes, 0 if its friction holds it."""
        pull = f - self._rig.stiffness * x
        return math.copysign(1.0, pull) if abs(pull) > self._friction(t, x, self._half_cycle) else 0.0

    def _piece(
        self, t: float, end: float, x: float, v: float, sign: float, f: float, slope: float
    ) -> tuple[_Piece, bool]:
        """Go on to ``end``, or to the turning point if that comes before."""
        r = self._friction(t, x, self._half_cycle)
        if sign == 0.0:
            return _Piece(t, end, x, x, 0.0, 0.0, f, f + slope * (end - t), r, r, 0.0), False
        h = end - t
        reached = self._advance(t, x, v, sign, f, slope, h)
        turned = reached[1] * sign < 0.0
        if turned:
            low, high = 0.0, h
            for _ in range(_BISECTIONS):
                h = 0.5 * (low + high)
                if self._advance(t, x, v, sign, f, slope, h)[1] * sign > 0.0:
                    low = h
                else:
                    high = h
            h = high
            reached = self._advance(t, x, v, sign, f, slope, h)[0], 0.0
        # the very end, so that no rounding leaves a sliver of a step
        stop = t + h if turned else end
        after = self._friction(stop, reached[0], self._half_cycle)
        return _Piece(t, stop, x, reached[0], v, reached[1], f, f + slope * h, r, after, sign), turned

    def _advance(
        self, t: float, x: float, v: float, sign: float, f: float, slope: float, h: float
    ) -> tuple[float, float]:
        """One Runge-Kutta step of fourth order: displacement and velocity after ``h``."""
        m, k, n, r = self._rig.mass, self._rig.stiffness, self._half_cycle, self._friction
        middle, centre = t + 0.5 * h, f + 0.5 * slope * h
        a1 = (f - k * x - sign * r(t, x, n)) / m
        x2, v2 = x + 0.5 * h * v, v + 0.5 * h * a1
        a2 = (centre - k * x2 - sign * r(middle, x2, n)) / m
        x3, v3 = x + 0.5 * h * v2, v + 0.5 * h * a2
        a3 = (centre - k * x3 - sign * r(middle, x3, n)) / m
        x4, v4 = x + h * v3, v + h * a3
        a4 = (f + slope * h - k * x4 - sign * r(t + h, x4, n)) / m
        return x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)

    def sample(self, times: NDArray[np.float64], quantity: str) -> NDArray[np.float64]:
        """Displacement [m], velocity [m/s] or acceleration [m/s2] at ``times`` [s].

        Cubic between the ends of a step; the acceleration is that of the equation of motion there.

        Parameters
        ----------
        times : ndarray, shape (n,)
            Negative before the start; at most the end of the force.
        quantity : {"displacement", "velocity", "acceleration"}
        """
        p = self._pieces
        owner = np.clip(np.searchsorted(p["t0"], times, side="right") - 1, 0, p["t0"].size - 1)
        x0, x1, v0, v1, f0, f1, r0, r1, sign = (
            p[name][owner] for name in ("x0", "x1", "v0", "v1", "f0", "f1", "r0", "r1", "sign")
        )
        length = p["t1"][owner] - p["t0"][owner]
        s = np.clip((times - p["t0"][owner]) / length, 0.0, 1.0)
        before = times < 0.0
        if quantity == "velocity":
            rise = (x1 - x0) / length
            speed = v0 + s * (6.0 * rise - 4.0 * v0 - 2.0 * v1 + s * 3.0 * (v0 + v1 - 2.0 * rise))
            return np.where(before, 0.0, speed)
        change, w0, w1 = x1 - x0, v0 * length, v1 * length
        x = x0 + s * (w0 + s * (3.0 * change - 2.0 * w0 - w1 + s * (w0 + w1 - 2.0 * change)))
        if quantity == "displacement":
            return np.asarray(x)
        pull = f0 + s * (f1 - f0) - self._rig.stiffness * x - sign * (r0 + s * (r1 - r0))
        return np.where(before | (sign == 0.0), 0.0, pull / self._rig.mass)

    def mean_friction(self, start: float, stop: float) -> float:
        """Mean friction [N] over the path travelled from ``start`` to ``stop`` [s]."""
        travel, work = (np.interp([start, stop], self._ends, each) for each in (self._travel, self._work))
        return float((work[1] - work[0]) / (travel[1] - travel[0]))
