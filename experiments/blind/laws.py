"""Free decays under many laws, integrated by scipy's DOP853 with the turning points as events.

Everything is dimensionless: displacement in initial amplitudes ``A``, time in ``1/w0``, so velocity is
in ``A w0`` and acceleration in ``A w0**2``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

__all__ = [
    "ABSOLUTE_TOLERANCE",
    "HARMONICS",
    "RELATIVE_TOLERANCE",
    "Law",
    "Motion",
    "integrate",
    "turn_waves",
]

RELATIVE_TOLERANCE = 1e-10
ABSOLUTE_TOLERANCE = 1e-12
"""Tolerances of DOP853 per step, in initial amplitudes; noise is never below a hundredth of one."""

HARMONICS = 4
"""Of a force that repeats with every turn of a rotor."""

_LONGEST_STEP = 0.8  # a quarter of a half cycle: no step may pass over two turning points


def turn_waves(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sines of ``n angle``, ``n`` from 1 to :data:`HARMONICS`, then cosines; shape (8, ...)."""
    return np.array([wave(n * angle) for wave in (np.sin, np.cos) for n in range(1, HARMONICS + 1)])


@dataclass(frozen=True, kw_only=True)
class Law:
    """Coulomb friction on a spring, and whatever else acts; zero means absent.

    Attributes
    ----------
    friction : float
        ``d = r/(k A)``.
    damping_ratio, drag, asymmetry, static_excess, stribeck_velocity, relative_change, cubic : float
        Catalogue: ``2 zeta v``, ``drag v |v|``, ``d (1 + e sign v)``, ``d (1 + x exp(-(v/vs)**2))``,
        ``d (1 + e (t/duration - 1/2))``, ``x + cubic x**3``.
    duration : float
        ``T`` of the drifting friction.
    stop_gap, stop_stiffness : float
        A one-sided spring, ``stop_stiffness (x - stop_gap)`` beyond the gap.
    patch_centre, patch_width, patch_boost : float
        Friction higher around one position, ``d (1 + boost exp(-((x - centre)/width)**2))``.
    drift_time : float
        Over the duration: friction approaches a level in this time; where it is zero it changes along a line.
    stiffness_change, quadratic_stiffness : float
        ``(1 + e (t/duration - 1/2)) x`` and ``x + quadratic_stiffness x |x|``.
    friction_tilt, friction_rise, friction_bend : float
        Friction that depends on position, ``d (1 + tilt x + rise |x| + bend x**2)``: ``d`` is its level in
        the middle.
    base_slips, base_creep, base_slip : tuple of float, float, float
        The support creeps at ``base_creep`` and jumps back by ``base_slip`` at the given times.
    swing : float
        Initial amplitude [rad], where a force repeats with every turn.
    turn_sines, turn_cosines : tuple of float
        A force that repeats with every turn, ``sum a_n sin(n swing x) + b_n cos(n swing x)`` added to the
        spring's ``x``.
    presliding : float
        Displacement over which friction builds up again after a turning point; followed by
        :mod:`experiments.blind.disturbed_motion` alone.
    """

    friction: float
    damping_ratio: float = 0.0
    drag: float = 0.0
    asymmetry: float = 0.0
    static_excess: float = 0.0
    stribeck_velocity: float = 1.0
    relative_change: float = 0.0
    drift_time: float = 0.0
    cubic: float = 0.0
    duration: float = 1.0
    stop_gap: float = 0.0
    stop_stiffness: float = 0.0
    patch_centre: float = 0.0
    patch_width: float = 1.0
    patch_boost: float = 0.0
    stiffness_change: float = 0.0
    quadratic_stiffness: float = 0.0
    friction_tilt: float = 0.0
    friction_rise: float = 0.0
    friction_bend: float = 0.0
    base_slips: tuple[float, ...] = ()
    base_creep: float = 0.0
    base_slip: float = 0.0
    swing: float = 0.0
    turn_sines: tuple[float, ...] = ()
    turn_cosines: tuple[float, ...] = ()
    presliding: float = 0.0

    def base(self, t: float, slips: int) -> float:
        """Position of the support after ``slips`` slips."""
        return self.base_creep * t - self.base_slip * slips

    def drive(self, t: float, x: float, v: float, slips: int) -> float:
        """Acceleration without friction."""
        # most of these are absent from most laws, and a record evaluates this a million times
        force = -(x - self.base(t, slips)) if self.base_creep or self.base_slip else -x
        if self.cubic:
            force -= self.cubic * x**3
        if self.stiffness_change or self.quadratic_stiffness:
            drifted = self.stiffness_change * (t / self.duration - 0.5) * x
            force -= drifted + self.quadratic_stiffness * x * abs(x)
        if self.damping_ratio or self.drag:
            force -= 2.0 * self.damping_ratio * v + self.drag * v * abs(v)
        if self.stop_stiffness and x > self.stop_gap:
            force -= self.stop_stiffness * (x - self.stop_gap)
        if not self.turn_sines:
            return force
        for n, (sine, cosine) in enumerate(zip(self.turn_sines, self.turn_cosines, strict=True), 1):
            force -= sine * math.sin(n * self.swing * x) + cosine * math.cos(n * self.swing * x)
        return force

    def drifted(self, u: float) -> float:
        """Share of friction's change that has come by a share of the duration, about its mean."""
        if not self.drift_time:
            return u - 0.5
        # of what is left to come, which decays from one
        end = math.exp(-1.0 / self.drift_time)
        mean = self.drift_time * (1.0 - end)
        return (mean - math.exp(-u / self.drift_time)) / (1.0 - end)

    def level(self, t: float, x: float, v: float, sign: float) -> float:
        """Friction level of a motion in direction ``sign``."""
        level = self.friction * (1.0 + self.asymmetry * sign)
        if self.static_excess:
            level *= 1.0 + self.static_excess * math.exp(-((v / self.stribeck_velocity) ** 2))
        if self.relative_change:
            level *= 1.0 + self.relative_change * self.drifted(t / self.duration)
        if self.patch_boost:
            level *= 1.0 + self.patch_boost * math.exp(-(((x - self.patch_centre) / self.patch_width) ** 2))
        if self.friction_tilt or self.friction_rise or self.friction_bend:
            level *= 1.0 + self.friction_tilt * x + self.friction_rise * abs(x) + self.friction_bend * x * x
        return level

    def acceleration(self, t: float, x: float, v: float, sign: float, slips: int) -> float:
        """Acceleration of a motion in direction ``sign``."""
        return self.drive(t, x, v, slips) - sign * self.level(t, x, v, sign)

    def excess(self, t: float, x: float, slips: int) -> tuple[float, float]:
        """How far the force on a mass at rest exceeds static friction, and the direction it pulls in."""
        pull = self.drive(t, x, 0.0, slips)
        sign = math.copysign(1.0, pull)
        return abs(pull) - self.level(t, x, 0.0, sign), sign


@dataclass(frozen=True)
class _Segment:
    """Motion in one direction, or rest (``sign`` 0), from ``start`` to ``stop``."""

    start: float
    stop: float
    sign: float
    slips: int
    state: Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Motion:
    """A free decay as a chain of smooth segments.

    Attributes
    ----------
    turning_times : ndarray
        When the velocity passed through zero.
    rest_time : float or None
        When the motion ended for good.
    """

    law: Law
    segments: tuple[_Segment, ...]
    turning_times: NDArray[np.float64]
    rest_time: float | None

    def sample(self, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Displacement and acceleration at increasing ``times``."""
        x = np.empty(times.size)
        acceleration = np.zeros(times.size)
        stops = np.array([segment.stop for segment in self.segments[:-1]])
        owner = np.searchsorted(stops, times, side="right")
        for index, segment in enumerate(self.segments):
            chosen = np.flatnonzero(owner == index)
            if chosen.size == 0:
                continue
            state = segment.state(times[chosen])
            x[chosen] = state[0]
            if segment.sign:
                acceleration[chosen] = [
                    self.law.acceleration(t, s, v, segment.sign, segment.slips)
                    for t, s, v in zip(
                        times[chosen].tolist(), state[0].tolist(), state[1].tolist(), strict=True
                    )
                ]
        return x, acceleration


def _rest(x: float) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    return lambda times: np.vstack([np.full(times.size, x), np.zeros(times.size)])


def _break_away(law: Law, t: float, x: float, slips: int, stop: float) -> float:
    """First time up to ``stop`` at which static friction no longer holds the mass; ``stop`` if it does."""

    def margin(time: float) -> float:
        return law.excess(time, x, slips)[0]

    grid = np.linspace(t, stop, 400)
    above = [time for time in grid if margin(time) > 0.0]
    if not above:
        return stop
    first = int(np.searchsorted(grid, above[0]))
    return float(brentq(margin, grid[first - 1], grid[first], xtol=1e-12)) if first else t


def integrate(law: Law, x: float, v: float, end: float) -> Motion:
    """Integrate a law from displacement ``x`` and velocity ``v`` until ``end``.

    Each segment between two velocity zeros is smooth in time but for the kinks that its law has; the
    zeros are events of DOP853. A mass at rest stays there while the pull is below static friction.
    """
    segments: list[_Segment] = []
    turning: list[float] = []
    t, slips = 0.0, 0
    limits = [*(slip for slip in law.base_slips if slip < end), end]
    rest_time: float | None = None
    while t < end:
        limit = limits[slips]
        sign = math.copysign(1.0, v)
        if v == 0.0:
            margin, sign = law.excess(t, x, slips)
            if margin <= 0.0:
                rest_time = t if rest_time is None else rest_time
                free = _break_away(law, t, x, slips, limit)
                if free > t:
                    segments.append(_Segment(t, free, 0.0, slips, _rest(x)))
                    t = free
                    slips += free == limit < end
                    continue
                _, sign = law.excess(t + 1e-9, x, slips)
        rest_time = None

        def turning_point(_time: float, state: NDArray[np.float64]) -> float:
            return float(state[1])

        turning_point.terminal = True  # type: ignore[attr-defined]
        turning_point.direction = -sign  # type: ignore[attr-defined]

        def slope(
            time: float, state: NDArray[np.float64], sign: float = sign, slips: int = slips
        ) -> tuple[float, float]:
            velocity = float(state[1])
            return velocity, law.acceleration(time, float(state[0]), velocity, sign, slips)

        solution = solve_ivp(
            slope,
            (t, limit),
            (x, v),
            method="DOP853",
            rtol=RELATIVE_TOLERANCE,
            atol=ABSOLUTE_TOLERANCE,
            max_step=_LONGEST_STEP,
            events=turning_point,
            dense_output=True,
        )
        if solution.status < 0:
            raise RuntimeError(f"DOP853 stopped at {solution.t[-1]:g}: {solution.message}")
        stop = float(solution.t[-1])
        segments.append(_Segment(t, stop, sign, slips, solution.sol))
        t, x, v = stop, float(solution.y[0, -1]), float(solution.y[1, -1])
        if solution.status == 1:
            turning.append(t)
            v = 0.0
        else:
            slips += t < end
    return Motion(law, tuple(segments), np.array(turning), rest_time)
