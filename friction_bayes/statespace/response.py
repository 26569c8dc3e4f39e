r"""The response of an oscillator to a force given along a path, at the sensor.

Over an interval ``h`` the state ``z = (x, v)`` takes

.. math:: z(h) = F(h) z(0) + \int_0^h F(h-s)\,(0, \phi(s))'\,ds

with the free motion ``F`` of the oscillator, and the integral is the quadrature of
:mod:`friction_bayes.statespace.measured_path`, which also gives the stiffness of the oscillator over
each interval. A sensor of displacement or velocity reads the state; an accelerometer reads ``-x + phi``, or
``-kappa x + phi`` with the slope ``kappa`` of a pendulum's restoring force at the sample.

A force that depends on the motion changes with the response. To first order that is a :class:`Feedback`: its
slopes in displacement and velocity, and at each turning point, where dry friction changes sign, the
acceleration after it over the one before it, by which a perturbation of the velocity is multiplied: the
saltation matrix of a hybrid system (Kong, Council and Johnson 2021). With it the responses to the forces
of a law are the exact derivatives of its motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import ZERO, Array, Indices
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.statespace.measured_path import LEEWAY, MeasuredPath
from friction_bayes.statespace.transition import free_motion

__all__ = ["Feedback", "at_sensor", "feedback_steps", "force_response", "response_at_sensor"]


class Feedback(NamedTuple):
    """Derivatives of the force of a law in the motion, about a path.

    Attributes
    ----------
    nodes : ndarray, shape (m, 2)
        Its derivative with displacement and with velocity at the nodes of the path.
    samples : ndarray, shape (n, 2)
        The same at the samples.
    passed : ndarray, shape (k,)
        Acceleration after each turning point over the one before it.
    """

    nodes: Array
    samples: Array
    passed: Array

    def bears(self, path: MeasuredPath) -> bool:
        """Whether the path is a motion of the law, by what follows from a unit start.

        A frequency that changes with the swing makes an error of the start grow with time, by no more than
        the slopes do; about a motion that is not the law's it grows exponentially.
        """
        span = float(path.phase[-1] - path.phase[0])
        grown = 1.0 + 0.5 * float(np.max(np.abs(self.nodes))) * span
        start = force_response(path, np.zeros((path.node_phase.size, 2)), np.eye(2), self)
        return bool(np.max(np.abs(start)) < LEEWAY * grown)

    @classmethod
    def none(cls, path: MeasuredPath) -> Feedback:
        """Of a force that does not depend on the motion."""
        return cls(
            np.zeros((path.node_phase.size, 2)), np.zeros((path.phase.size, 2)), np.ones(path.turning.size)
        )


class _Course(NamedTuple):
    """The samples, nodes and turning points of a path."""

    phase: Array
    stiffness: Array
    interval: Indices
    node_phase: Array
    weight: Array
    turning: Array


def force_response(
    path: MeasuredPath, forces: Array, start: Array | None = None, feedback: Feedback | None = None
) -> Array:
    """Displacement and velocity that follow from forces.

    Parameters
    ----------
    path : MeasuredPath
    forces : ndarray, shape (m, p)
        At the nodes of the path.
    start : ndarray, optional, shape (2, p)
        Displacement and velocity at the first sample; at rest where left out.
    feedback : Feedback, optional
        Of the forces that depend on the response; none by default.

    Returns
    -------
    ndarray, shape (n, 2, p)
    """
    forces = np.ascontiguousarray(forces, dtype=np.float64)
    states = np.zeros((path.phase.size, 2, forces.shape[1]))
    if start is not None:
        states[0] = start
    slope, _, passed = Feedback.none(path) if feedback is None else feedback
    _drive(_course(path), forces, slope, passed, states)
    return states


def response_at_sensor(
    path: MeasuredPath,
    row: Array,
    at_nodes: Array,
    at_samples: Array,
    start: Array | None = None,
    feedback: Feedback | None = None,
) -> tuple[Array, Array]:
    """States that follow from forces, shape (n, 2, p), and the sensor's reading of them, shape (n, p).

    Parameters
    ----------
    path, start, feedback
        See :func:`force_response`.
    row : ndarray, shape (3,) or (n, 3)
        Of the sensor.
    at_nodes, at_samples : ndarray, shapes (m, p) and (n, p)
        The forces.
    """
    states = force_response(path, at_nodes, start, feedback)
    if feedback is not None:
        slope = feedback.samples
        at_samples = at_samples + slope[:, :1] * states[:, 0] + slope[:, 1:] * states[:, 1]
    return states, at_sensor(states, row, at_samples)


def at_sensor(states: Array, row: Array, forces: Array | None = None) -> Array:
    """Sensor output, shape (n, p).

    Parameters
    ----------
    states : ndarray, shape (n, 2, p)
        Displacement and velocity.
    row : ndarray, shape (3,) or (n, 3)
        From :func:`friction_bayes.statespace.kalman.sensor_row`.
    forces : ndarray, optional, shape (n, p)
        Forces at the samples, which an accelerometer reads; at a turning point, the mean over the
        uncertainty of the velocity.
    """
    out = row[..., :1] * states[:, 0] + row[..., 1:2] * states[:, 1]
    return out if forces is None else out + row[..., 2:] * forces


def feedback_steps(path: MeasuredPath, feedback: Feedback) -> Array:
    """Propagation of a perturbation by a force that depends on the motion, relative to the oscillator's.

    Over each interval, from the state that the oscillator alone would lead to, shape (n - 1, 2, 2).
    """
    course = _course(path)
    none, moved = np.zeros((path.node_phase.size, 2)), np.empty((path.phase.size - 1, 2, 2))
    _perturb(course, none, feedback.nodes, feedback.passed, moved)
    return moved


def _course(path: MeasuredPath) -> _Course:
    return _Course(path.phase, path.stiffness, path.interval, path.node_phase, path.node_weight, path.turning)


@njit(**KERNEL)
def _drive(course: _Course, forces: Array, slope: Array, passed: Array, states: Array) -> None:
    """Fill the states, shape (n, 2, p), from the first on: forces act as impulses at the nodes."""
    k = turn = ZERO
    for i in range(course.phase.size - 1):
        # by a loop: assigning arrays costs the compiler a second
        for j in range(states.shape[2]):
            states[i + 1, 0, j], states[i + 1, 1, j] = states[i, 0, j], states[i, 1, j]
        k, turn = _over(course, i, k, turn, forces, slope, passed, states[i + 1])


@njit(**KERNEL)
def _perturb(course: _Course, forces: Array, slope: Array, passed: Array, moved: Array) -> None:
    """Fill the propagation of a unit displacement and velocity in each interval, less the oscillator's."""
    k = turn = ZERO
    state = np.empty((2, 2))
    for i in range(course.phase.size - 1):
        state[0, 0] = state[1, 1] = 1.0
        state[0, 1] = state[1, 0] = 0.0
        k, turn = _over(course, i, k, turn, forces, slope, passed, state)
        stiffness = course.stiffness[i]
        cosine, sine = free_motion(course.phase[i + 1] - course.phase[i], stiffness)
        for row in range(2):
            # the free motion backward
            moved[i, row, 0] = state[row, 0] * cosine + state[row, 1] * stiffness * sine
            moved[i, row, 1] = state[row, 1] * cosine - state[row, 0] * sine


@njit(**INNER)
def _over(  # type: ignore[no-untyped-def]
    course: _Course, i: int, k: int, turn: int, forces: Array, slope: Array, passed: Array, state: Array
):
    """Propagate a state, shape (2, p), over interval ``i``, and advance nodes and turning points."""
    phase, stiffness, interval, node_phase, weight, turning = course
    m, p = forces.shape
    at, sample = phase[i], False
    while not sample:
        to, node = phase[i + 1], k < m and interval[k] == i
        if node:
            to = node_phase[k]
        turns = turn < turning.size and turning[turn] < to
        if turns:
            to = turning[turn]
        cosine, sine = free_motion(to - at, stiffness[i])
        back = -stiffness[i] * sine
        for j in range(p):
            x, v = state[0, j], state[1, j]
            state[0, j] = cosine * x + sine * v
            state[1, j] = back * x + cosine * v
        at, sample = to, not (node or turns)
        if turns:
            for j in range(p):
                state[1, j] *= passed[turn]
            turn += 1
        elif node:
            # the velocity in the middle of the impulse, which changes it
            w = weight[k] / (1.0 - 0.5 * weight[k] * slope[k, 1])
            for j in range(p):
                answer = slope[k, 0] * state[0, j] + slope[k, 1] * state[1, j]
                state[1, j] += w * (forces[k, j] + answer)
            k += 1
    return k, turn
