"""Free decays that a force of any shape acts on, and contacts that spring back before they slide.

Dimensionless as :mod:`experiments.blind.laws`. The force is given on a fine grid and linear between its
points; Runge-Kutta of fourth order from point to point, with the velocity zero found inside the step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.blind.laws import Law

__all__ = ["DisturbedMotion", "acceleration_of", "integrate_disturbed"]

_MOST_TURNS = 4
"""Within one step."""
_AT_REST = (
    math.pi
)  # whoever sticks for half a cycle has come to rest, though a strong force may free it again


@dataclass(frozen=True)
class _Contact:
    """One direction of motion, from a turning point on.

    Attributes
    ----------
    sign : float
        Direction; 0 while the mass sticks.
    slips : int
        Of the support.
    turn, built_up : float
        Where the motion turned, and the share of friction that acted there, of the sign of its direction.
    """

    sign: float
    slips: int
    turn: float
    built_up: float


@dataclass(frozen=True)
class DisturbedMotion:
    """A free decay on the knots of its integration: the grid of the force, and the turning points.

    Attributes
    ----------
    law : Law
    times, x, v : ndarray, shape (n,)
        Knots.
    contacts : tuple, length n
        From each knot on.
    step : float
        Of the force's grid.
    force : ndarray
        On that grid.
    turning_times : ndarray
        When the velocity passed through zero, up to the rest.
    rest_time : float or None
        When the mass first stuck for half a cycle.
    """

    law: Law
    times: NDArray[np.float64]
    x: NDArray[np.float64]
    v: NDArray[np.float64]
    contacts: tuple[_Contact, ...]
    step: float
    force: NDArray[np.float64]
    turning_times: NDArray[np.float64]
    rest_time: float | None

    def sample(self, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Displacement and acceleration at ``times``, by cubic Hermite interpolation between knots."""
        owner = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, self.times.size - 2)
        length = self.times[owner + 1] - self.times[owner]
        s = (times - self.times[owner]) / length
        x0, x1 = self.x[owner], self.x[owner + 1]
        v0, v1 = self.v[owner] * length, self.v[owner + 1] * length
        change = x1 - x0
        bend = 3.0 * change - 2.0 * v0 - v1
        twist = v0 + v1 - 2.0 * change
        x = x0 + s * (v0 + s * (bend + s * twist))
        v = (v0 + s * (2.0 * bend + s * 3.0 * twist)) / length
        force = np.interp(times, self.step * np.arange(self.force.size), self.force)
        acceleration = np.zeros(times.size)
        for i, knot in enumerate(owner.tolist()):
            contact = self.contacts[knot]
            if contact.sign:
                acceleration[i] = acceleration_of(self.law, contact, times[i], x[i], v[i], force[i])
        return x, acceleration


def _built_up(law: Law, contact: _Contact, x: float) -> float:
    """Share of friction that acts at ``x``, from -1 (as before the turning point) to 1.

    The Dahl model of exponent 1, ``ds/dx = (1 - s sign(v)) / s0``, in closed form along one direction.
    """
    return 1.0 - (1.0 - contact.built_up) * math.exp(-abs(x - contact.turn) / law.presliding)


def acceleration_of(law: Law, contact: _Contact, t: float, x: float, v: float, force: float) -> float:
    """Acceleration of a mass in contact under a force."""
    friction = law.level(t, x, v, contact.sign)
    if law.presliding:
        friction *= _built_up(law, contact, x)
    return law.drive(t, x, v, contact.slips) - contact.sign * friction + force


def _step(
    law: Law, contact: _Contact, t: float, x: float, v: float, force: float, slope: float, h: float
) -> tuple[float, float]:
    """One Runge-Kutta step of length ``h`` under ``force + slope (time - t)``."""
    middle = force + 0.5 * slope * h
    a1 = acceleration_of(law, contact, t, x, v, force)
    v2 = v + 0.5 * h * a1
    a2 = acceleration_of(law, contact, t + 0.5 * h, x + 0.5 * h * v, v2, middle)
    v3 = v + 0.5 * h * a2
    a3 = acceleration_of(law, contact, t + 0.5 * h, x + 0.5 * h * v2, v3, middle)
    v4 = v + h * a3
    a4 = acceleration_of(law, contact, t + h, x + h * v3, v4, force + slope * h)
    return x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


def _length_to_turn(
    law: Law, contact: _Contact, t: float, x: float, v: float, force: float, slope: float, h: float
) -> float:
    """Length of the partial step that ends at zero velocity, by bisection."""
    low, high = 0.0, h
    for _ in range(40):
        middle = 0.5 * (low + high)
        if _step(law, contact, t, x, v, force, slope, middle)[1] * contact.sign > 0.0:
            low = middle
        else:
            high = middle
    return high


def _after_turn(law: Law, before: _Contact, t: float, x: float, force: float) -> _Contact:
    """Contact of a mass whose velocity is zero: on in the direction of the pull, or stuck."""
    if law.presliding:
        turned = -before.sign
        return _Contact(turned, before.slips, x, -_built_up(law, before, x))
    pull = law.drive(t, x, 0.0, before.slips) + force
    sign = math.copysign(1.0, pull)
    moves = abs(pull) > law.level(t, x, 0.0, sign)
    return _Contact(sign if moves else 0.0, before.slips, x, 1.0)


def integrate_disturbed(
    law: Law, x: float, v: float, step: float, force: NDArray[np.float64]
) -> DisturbedMotion:
    """Integrate a law under a force from displacement ``x`` and velocity ``v``.

    Parameters
    ----------
    law : Law
        With ``presliding`` or without; the support slips at points of the grid.
    x, v : float
        Start. Released at rest, a mass begins with friction fully built up against its motion.
    step : float
        Of the grid: well below the correlation time of the force, and below the time in which friction
        builds up.
    force : ndarray, shape (n,)
        On the grid, from time zero on; the motion ends with it.
    """
    sign = math.copysign(1.0, v if v else law.drive(0.0, x, 0.0, 0) + float(force[0]))
    contact = _Contact(sign, 0, x, 1.0)
    if v == 0.0 and not law.presliding:
        contact = _after_turn(law, contact, 0.0, x, float(force[0]))
    knots: list[tuple[float, float, float]] = []
    contacts: list[_Contact] = []
    turning: list[float] = []
    stuck_since, rest_time = 0.0, None
    values = force.tolist()
    for i in range(len(values) - 1):
        t, start = i * step, i * step
        slope = (values[i + 1] - values[i]) / step
        slips = sum(slip <= t for slip in law.base_slips) if law.base_slips else 0
        if slips != contact.slips:
            contact = _Contact(contact.sign, slips, contact.turn, contact.built_up)
        if contact.sign == 0.0:
            contact = _after_turn(law, contact, t, x, values[i])
        # a contact that builds up may turn ever faster about one place: then it stays there for the step
        for _ in range(_MOST_TURNS):
            knots.append((t, x, v))
            contacts.append(contact)
            left = start + step - t
            if contact.sign == 0.0:
                break
            d = values[i] + slope * (t - start)
            x1, v1 = _step(law, contact, t, x, v, d, slope, left)
            if v1 * contact.sign >= 0.0:
                x, v = x1, v1
                break
            part = _length_to_turn(law, contact, t, x, v, d, slope, left)
            x, _ = _step(law, contact, t, x, v, d, slope, part)
            t, v = t + part, 0.0
            turning.append(t)
            stuck_since = t
            contact = _after_turn(law, contact, t, x, d + slope * part)
            if start + step - t < 1e-12:
                break
        if contact.sign == 0.0 and rest_time is None and t - stuck_since > _AT_REST:
            rest_time = stuck_since
    knots.append((start + step, x, v))
    contacts.append(contact)
    columns = np.array(knots)
    # a turning point at the end of a step makes a knot of no length
    kept = np.append(np.diff(columns[:, 0]) > 0.0, True)
    return DisturbedMotion(
        law=law,
        times=columns[kept, 0],
        x=columns[kept, 1],
        v=columns[kept, 2],
        contacts=tuple(contact for contact, keep in zip(contacts, kept, strict=True) if keep),
        step=step,
        force=force,
        turning_times=np.array([t for t in turning if rest_time is None or t <= rest_time]),
        rest_time=rest_time,
    )
