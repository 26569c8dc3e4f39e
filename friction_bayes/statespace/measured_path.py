r"""The measured motion between its samples, at the nodes of a quadrature.

Between two samples the motion is that of the oscillator under the force, linear in time, that takes it from
one measured state to the next,

.. math:: x(s) = x_0 \cos s + v_0 \sin s + f_0 (1-\cos s) + f_1 (s-\sin s),

an interpolation that is exact for the free oscillation at any sampling rate, and approximates the small force
alone. Where the velocity changes sign the interval is split at the crossing, so that every piece has one
direction of motion. Friction jumps there, and no force linear in time describes it: the motion is continued
from either side under the mean force of the interval before and after, and the crossing is the mean of the
two crossings.

A pendulum's restoring force ``sin x`` is taken along the measured motion ``xm``, and near it by its slope,

.. math:: \sin x \approx \kappa x + (\sin x_m - \kappa x_m), \quad \kappa \approx \cos x_m:

with the slope left at one, an error of ``xm`` would pass for a force of ``1 - cos xm`` of its size. ``kappa``
is constant over an interval and rounded, so that few transitions are distinct; the error is of second order,
as the same ``kappa`` is in the known force. An accelerometer reads the restoring force with the slope at the
sample. Units are those of :mod:`friction_bayes.statespace.transition`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import erf

from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.core.errors import InputError
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.statespace.transition import initial_response

__all__ = ["LEEWAY", "NEAR_TURN", "MeasuredPath", "Points", "stiffness_along"]

NEAR_TURN = 0.02
"""Phase from a turning point, where an accelerometer jumps, within which its sample is not used: it may be on
either side, and a fit would take one for certain. One sample in eighty is as near."""

_ABSCISSAE, _WEIGHTS = (0.5 * each for each in np.polynomial.legendre.leggauss(3))
_STIFFNESS_STEP = 0.005
"""To which the slope of a pendulum's restoring force is rounded."""
_LEFT_OUT = 0.01
"""Share of a force by which the linear restoring force may differ from a pendulum's."""
LEEWAY = 4.0
"""Largest growth of an error, relative to that under the swing alone."""
_LONGEST_PIECE = 0.15
"""Phase over which three Gauss nodes integrate a force to rounding in practice."""


class Points(NamedTuple):
    """States at which a force is evaluated.

    Attributes
    ----------
    phase, x, v : ndarray, shape (m,)
        Time and motion, natural units.
    direction : ndarray, shape (m,)
        Direction of motion, -1 to 1.
    """

    phase: Array
    x: Array
    v: Array
    direction: Array


@dataclass(frozen=True, eq=False)
class MeasuredPath:
    """A smoothed motion and the nodes of the quadrature along it.

    Attributes
    ----------
    phase, x, v : ndarray, shape (n,)
        Samples.
    v_sd : ndarray, shape (n,)
        Standard deviation of the smoothed velocity.
    pendulum : bool
        Whether the restoring force is that of a pendulum.
    stiffness : ndarray, shape (n - 1,)
        Slope of the restoring force over each interval.
    slope : ndarray, shape (n,)
        The same at the samples.
    interval : ndarray of int, shape (m,)
        Interval of every node, ascending.
    node_phase, node_x, node_v, direction : ndarray, shape (m,)
        Time, motion and direction of motion (+1 or -1) at the nodes.
    node_weight : ndarray, shape (m,)
        Weights of the quadrature: the integral of a force over an interval is the weighted sum over its
        nodes.
    turning, turning_x : ndarray, shape (k,)
        Phases of the turning points, between samples, ascending, and the displacements there.
    """

    phase: Array
    x: Array
    v: Array
    v_sd: Array
    pendulum: bool
    stiffness: Array
    slope: Array
    interval: Indices
    node_phase: Array
    node_x: Array
    node_v: Array
    direction: Array
    node_weight: Array
    turning: Array
    turning_x: Array

    @property
    def angle(self) -> float:
        """Phase from sample to sample, on average."""
        return float(self.phase[-1] - self.phase[0]) / (self.phase.size - 1)

    @classmethod
    def through(
        cls, phase: Array, x: Array, v: Array, v_sd: Array | None = None, *, pendulum: bool = False
    ) -> MeasuredPath:
        """Lay the path through states at ``phase``, all of shape (n,), of an oscillator or a pendulum.

        Raises
        ------
        InputError
            If two samples lie half a period or more apart, between which the motion is not determined; give
            the smoothed states inside such a gap too.
        """
        if np.max(np.diff(phase), initial=0.0) >= math.pi:
            raise InputError(
                "time",
                f"a gap of {np.max(np.diff(phase)) / (2.0 * math.pi):.3g} periods",
                "give the smoothed states inside it too",
            )
        # columns of states are strided, for which numba would compile anew
        x, v = np.ascontiguousarray(x), np.ascontiguousarray(v)
        nodes, turning = _nodes(phase, x, v, 0.5 + _ABSCISSAE, _WEIGHTS)
        stiffness, slope = np.ones(x.size - 1), np.ones(x.size)
        if pendulum:
            stiffness, slope = stiffness_along(phase, x, v)
        return cls(
            phase,
            x,
            v,
            np.zeros_like(v) if v_sd is None else v_sd,
            pendulum,
            stiffness,
            slope,
            nodes[0].astype(np.intp),
            *nodes[1:],
            *turning,
        )

    @property
    def nodes(self) -> Points:
        """Where a force is evaluated for its response."""
        return Points(self.node_phase, self.node_x, self.node_v, self.direction)

    @property
    def samples(self) -> Points:
        """The samples, with the expected direction of motion."""
        return Points(self.phase, self.x, self.v, self.expected_direction)

    @property
    def expected_direction(self) -> Array:
        """Posterior mean of the sign of the velocity at the samples, shape (n,)."""
        known = self.v_sd == 0.0
        smeared = erf(self.v / (math.sqrt(2.0) * np.where(known, 1.0, self.v_sd)))
        return np.where(known, np.sign(self.v), smeared)

    def restoring(self, x: Array) -> Array:
        """Restoring force at displacements, natural units."""
        return np.sin(x) if self.pendulum else x

    def reading(self, order: int, x: Array, v: Array) -> Array:
        """Reading by a sensor of the derivative ``order`` of a motion under the restoring force alone."""
        return (x, v, -self.restoring(x))[order]

    def jump_places(self, order: int) -> Array:
        """Where a sensor of the derivative ``order`` jumps, as of indices of samples, shape (k,)."""
        if order < 2:
            return np.empty(0)
        return np.asarray(np.interp(self.turning, self.phase, np.arange(self.phase.size)))

    def jumps(self, order: int) -> Indices:
        """Samples next to which it jumps, shape (k,)."""
        return np.rint(self.jump_places(order)).astype(np.intp)

    def missed_jumps(self, order: int) -> Array:
        """What samples do not show of the direction next to their :meth:`jumps`, shape (n,).

        The mean direction over a step about each sample, less that of the sample.
        """
        missed, last = np.zeros(self.phase.size), self.phase.size - 1
        for k, place in zip(self.jumps(order).tolist(), self.jump_places(order).tolist(), strict=True):
            after = math.copysign(1.0, self.v[min(k + 1, last)])
            missed[k] = after * 2.0 * (k - place) - self.expected_direction[k]
        return missed

    def serves(self, x: Array, force: float) -> bool:
        """Whether the slopes along this path hold for another motion, of displacements ``x``, shape (n,).

        Their error of the restoring force is then small compared with a ``force`` that is looked for.
        """
        left_out = self.restoring(x) - self.restoring(self.x) - self.slope * (x - self.x)
        return bool(np.max(np.abs(left_out)) < _LEFT_OUT * force)


def stiffness_along(phase: Array, x: Array, v: Array) -> tuple[Array, Array]:
    """Slope of a pendulum's restoring force over each interval, shape (n - 1,), and at the samples, (n,).

    One throughout where the motion is not that of a pendulum: an error of its start, which grows with time as
    a larger swing takes longer, would then grow exponentially, by parametric resonance.

    Parameters
    ----------
    phase, x, v : ndarray, shape (n,)
        Time, angle and its rate.
    """
    step, cosine, rate = np.diff(phase), np.cos(x), -np.sin(x) * v
    mean = 0.5 * (cosine[:-1] + cosine[1:]) + step / 12.0 * (rate[:-1] - rate[1:])
    stiffness, slope = (
        np.round(np.clip(each, -1.0, 1.0) / _STIFFNESS_STEP) * _STIFFNESS_STEP for each in (mean, cosine)
    )
    # the frequency falls by an eighth of the square of the swing, relative to the change of the swing
    grown = 1.0 + 0.125 * float(np.max(x * x)) * float(phase[-1] - phase[0])
    if np.max(np.abs(initial_response(phase, stiffness))) < LEEWAY * grown:
        return stiffness, slope
    return np.ones_like(stiffness), np.ones_like(slope)


@njit(**INNER)
def _force_between(x0: float, v0: float, x1: float, v1: float, h: float) -> tuple[float, float]:
    """``f0, f1`` of the force ``f0 + f1 s`` that leads from one state to the next in ``h``.

    ``h - sin h`` and the determinant ``2 (1 - cos h) - h sin h`` are summed as series: written so, they lose
    all digits at short steps.
    """
    cosine, sine = math.cos(h), math.sin(h)
    rise = 2.0 * math.sin(0.5 * h) ** 2
    term = h**3 / 6.0
    slack = term
    k = 3
    while abs(term) > 1e-17 * abs(slack):
        term *= -h * h / ((k + 1) * (k + 2))
        slack += term
        k += 2
    power = h**4 / 24.0
    determinant = 2.0 * power
    change = determinant
    j = 2
    while abs(change) > 1e-17 * abs(determinant):
        power *= -h * h / ((2 * j + 1) * (2 * j + 2))
        j += 1
        change = power * (2 * j - 2)
        determinant += change
    dx = x1 + x0 * rise - x0 - v0 * sine
    dv = v1 + x0 * sine - v0 * cosine
    return (rise * dx - slack * dv) / determinant, (rise * dv - sine * dx) / determinant


@njit(**INNER)
def _state(x0: float, v0: float, f0: float, f1: float, s: float) -> tuple[float, float]:
    """Displacement and velocity a phase ``s`` later, under the force ``f0 + f1 s``."""
    cosine, sine = math.cos(s), math.sin(s)
    rise = 2.0 * math.sin(0.5 * s) ** 2
    if s < 0.2:
        s2 = s * s
        slack = s * s2 / 6.0 * (1.0 - s2 / 20.0 * (1.0 - s2 / 42.0 * (1.0 - s2 / 72.0)))
    else:
        slack = s - sine
    return x0 * cosine + v0 * sine + f0 * rise + f1 * slack, -x0 * sine + v0 * cosine + f0 * sine + f1 * rise


@njit(**INNER)
def _crossing(x0: float, v0: float, f0: float, f1: float, h: float) -> float:
    """Phase at which the velocity changes sign, by secants kept inside a shrinking bracket."""
    low, high, v_low = 0.0, h, v0
    v_high = _state(x0, v0, f0, f1, h)[1]
    for _ in range(60):
        width = high - low
        if width < 1e-13 * h:
            break
        s = low + width * v_low / (v_low - v_high)
        s = min(max(s, low + 0.05 * width), high - 0.05 * width)
        vs = _state(x0, v0, f0, f1, s)[1]
        if vs == 0.0:
            return s
        if (vs > 0.0) == (v_low > 0.0):
            low, v_low = s, vs
        else:
            high, v_high = s, vs
    return 0.5 * (low + high)


@njit(**KERNEL)
def _nodes(phase: Array, x: Array, v: Array, abscissae: Array, weights: Array) -> tuple[Array, Array]:
    """Nodes, shape (6, m): interval, phase, x, v, direction, weight; turning points, shape (2, k)."""
    n = phase.size
    order = abscissae.size
    count, turns = 0, 0
    force = np.empty((2, n - 1))
    crosses = np.zeros(n - 1, np.bool_)
    for i in range(n - 1):
        h = phase[i + 1] - phase[i]
        count += math.ceil(h / _LONGEST_PIECE) + 1
        crosses[i] = (v[i] > 0.0) != (v[i + 1] > 0.0)
        turns += crosses[i]
        force[0, i], force[1, i] = _force_between(x[i], v[i], x[i + 1], v[i + 1], h)
    nodes = np.empty((6, count * order))
    turning = np.empty((2, turns))
    ends = np.zeros(3)
    m, turn = 0, 0
    for i in range(n - 1):
        h = phase[i + 1] - phase[i]
        ends[1], ends[2] = h, h
        parts, sided, before, after = 1, False, 0.0, 0.0
        if crosses[i]:
            parts = 2
            ends[1], turning[1, turn], sided, before, after = _turn(phase, x, v, force, crosses, i)
            turning[0, turn] = phase[i] + ends[1]
            turn += 1
        for part in range(parts):
            direction = 1.0 if v[i + part] > 0.0 else -1.0
            length = ends[part + 1] - ends[part]
            pieces = max(1, math.ceil(length / _LONGEST_PIECE - 1e-9))
            for piece in range(pieces):
                for k in range(order):
                    s = ends[part] + (piece + abscissae[k]) * length / pieces
                    nodes[0, m] = i
                    nodes[1, m] = phase[i] + s
                    if not sided:
                        nodes[2, m], nodes[3, m] = _state(x[i], v[i], force[0, i], force[1, i], s)
                    elif part == 0:
                        nodes[2, m], nodes[3, m] = _state(x[i], v[i], before, 0.0, s)
                    else:
                        nodes[2, m], nodes[3, m] = _state(x[i + 1], v[i + 1], after, 0.0, s - h)
                    nodes[4, m] = direction
                    nodes[5, m] = weights[k] * length / pieces
                    m += 1
    return nodes[:, :m].copy(), turning


@njit(**INNER)
def _turn(
    phase: Array, x: Array, v: Array, force: Array, crosses: Mask, i: int
) -> tuple[float, float, bool, float, float]:
    """Turning point in an interval: phase from its start, and displacement.

    Then whether the motion goes on from either side, and the mean forces under which it does, before and
    after; else it does not jump there, under the ``force`` that leads over the interval.
    """
    h = phase[i + 1] - phase[i]
    if 0 < i < phase.size - 2 and not crosses[i - 1] and not crosses[i + 1]:
        before = force[0, i - 1] + 0.5 * force[1, i - 1] * (phase[i] - phase[i - 1])
        after = force[0, i + 1] + 0.5 * force[1, i + 1] * (phase[i + 2] - phase[i + 1])
        left = math.atan2(abs(v[i]), abs(x[i] - before))
        right = math.atan2(abs(v[i + 1]), abs(x[i + 1] - after))
        # from the left the motion comes to rest, from the right it starts
        if v[i] * (x[i] - before) >= 0.0 and v[i + 1] * (x[i + 1] - after) <= 0.0 and max(left, right) <= h:
            at = 0.5 * (left + h - right)
            from_left = _state(x[i], v[i], before, 0.0, at)[0]
            from_right = _state(x[i + 1], v[i + 1], after, 0.0, at - h)[0]
            return at, 0.5 * (from_left + from_right), True, before, after
    at = _crossing(x[i], v[i], force[0, i], force[1, i], h)
    return at, _state(x[i], v[i], force[0, i], force[1, i], at)[0], False, 0.0, 0.0
