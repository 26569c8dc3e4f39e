r"""Derivatives of a motion in its initial state and in the parameters of its law, beside the motion itself.

With the acceleration ``a(t, x, v; theta)`` the derivative ``d`` of the displacement in a parameter obeys

.. math:: d'' = a_x d + a_v d' + a_\theta,

which is linear and smooth within a half cycle. Over each step of the motion it is solved by Gauss collocation
(Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.7): its second derivative
is a polynomial through its values at Gauss nodes, where the motion is that of the step's dense output. The
steps need not be shorter: over the longest, 0.7 rad, the polynomials are wrong by 1e-9.

Where the velocity passes zero the acceleration jumps from ``a-`` to ``a+``, and a perturbation of the
velocity shifts the time of the jump: it goes on ``a+/a-`` as large, and that of the displacement as it is
(the saltation matrix of a hybrid system: Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth
Mechanical Systems, 2004). Where the mass sticks no perturbation of the velocity is left.

The partial derivatives of a force are central differences of that force alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial import Polynomial, legendre

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.mechanics.dormand_prince import acceleration, dense_value

__all__ = [
    "DISPLACEMENT",
    "FRICTION",
    "MASS",
    "OWN",
    "STIFFNESS",
    "VELOCITY",
    "Columns",
    "columns_at_rest",
    "columns_at_start",
    "columns_at_turn",
    "columns_over_step",
    "empty_columns",
]

DISPLACEMENT, VELOCITY, FRICTION, MASS, STIFFNESS, OWN = range(6)
"""Numbers of the columns: initial state, constants of the law, from ``OWN`` on the force parameters."""

NODES = 7
_RELATIVE_STEP = 1e-6
"""Difference step in the state and in friction, over amplitude, its velocity and the spring's force."""
PARAMETER_STEP = 1e-5
"""The same in mass, stiffness and a force parameter, over its value."""
_FAST = {"reassoc", "contract", "arcp", "nsz"}
"""Sums of the columns may be taken in any order, several at once; the motion itself is not touched."""


def _collocation() -> tuple[Array, Array, Array, Array]:
    """Gauss nodes on 0 .. 1, and matrices that act on values there.

    They give the coefficients of the polynomial through the values, and its integral and double integral up
    to each node.
    """
    nodes = 0.5 * (legendre.leggauss(NODES)[0] + 1.0)
    coefficients = np.empty((NODES, NODES))
    once, twice = np.empty((NODES, NODES)), np.empty((NODES, NODES))
    for j in range(NODES):
        others = np.delete(nodes, j)
        basis = Polynomial.fromroots(others) / np.prod(nodes[j] - others)
        coefficients[:, j] = basis.coef
        once[:, j], twice[:, j] = basis.integ(1)(nodes), basis.integ(2)(nodes)
    return nodes, coefficients, once, twice


_NODES, _COEFFICIENTS, _ONCE, _TWICE = _collocation()


class Partials(NamedTuple):
    """Partial derivatives of a force, compiled.

    Attributes
    ----------
    in_motion : callable
        In displacement, velocity, friction, mass and stiffness.
    in_parameter : callable
        In one of its parameters.
    """

    in_motion: Callable[..., tuple[float, ...]]
    in_parameter: Callable[..., float]


class Columns(NamedTuple):
    """Derivatives of a motion of ``n`` samples in ``m`` parameters, and room to compute them in.

    Attributes
    ----------
    out : ndarray, shape (m, n)
        Derivatives of the samples of displacement, velocity or acceleration.
    order : int
        Which of these: 0, 1 or 2.
    forcing : ndarray, shape (m,)
        Place of each parameter in ``gradient``.
    x, v : ndarray, shape (m,)
        Derivatives of displacement and velocity at present.
    gradient : ndarray, shape (OWN + parameters + 1,)
        Partial derivatives of mass times acceleration with its sign turned: in displacement, velocity,
        friction, mass, stiffness and the force parameters; then a zero, for columns of the initial state.
    steps : tuple of float
        Difference steps in the first five of these; zero where no column is wanted.
    slopes : ndarray, shape (NODES, m)
        Second derivatives by time at the nodes of a step.
    coefficients : ndarray, shape (m, NODES)
        Of the polynomials through them.
    matrix : ndarray, shape (NODES, NODES)
        Of their linear equations.
    """

    out: Array
    order: int
    forcing: Integers
    x: Array
    v: Array
    gradient: Array
    steps: tuple[float, float, float, float, float]
    slopes: Array
    coefficients: Array
    matrix: Array


@njit(nogil=True)
def empty_columns(wanted, n, order, x, v, friction, mass, stiffness, parameters):  # type: ignore[no-untyped-def]
    """The columns ``wanted``, by number, of ``n`` samples of a motion that starts at ``x, v``.

    ``parameters`` is the number of force parameters, ``order`` the derivative that is measured.
    """
    w0 = math.sqrt(stiffness / mass)
    amplitude = math.hypot(x, v / w0) + friction / stiffness
    if amplitude == 0.0:
        amplitude = 1.0
    m = wanted.size
    friction_step, mass_step, stiffness_step = 0.0, 0.0, 0.0
    forcing = np.empty(m, dtype=np.int64)
    columns_x, columns_v = np.zeros(m), np.zeros(m)
    for c in range(m):
        place = wanted[c]
        forcing[c] = place
        if place <= VELOCITY:
            forcing[c] = OWN + parameters
            columns_x[c] = 1.0 if place == DISPLACEMENT else 0.0
            columns_v[c] = 1.0 if place == VELOCITY else 0.0
        elif place == FRICTION:
            friction_step = _RELATIVE_STEP * stiffness * amplitude
        elif place == MASS:
            mass_step = PARAMETER_STEP * mass
        elif place == STIFFNESS:
            stiffness_step = PARAMETER_STEP * stiffness
    step = _RELATIVE_STEP * amplitude
    return Columns(
        np.full((m, n), np.nan),
        order,
        forcing,
        columns_x,
        columns_v,
        np.zeros(OWN + parameters + 1),
        (step, step * w0, friction_step, mass_step, stiffness_step),
        np.empty((NODES, m)),
        np.empty((m, NODES)),
        np.empty((NODES, NODES)),
    )


@njit(nogil=True)
def _fill_gradient(partials, law, p, steps, forcing, out, t, x, v, direction, a):  # type: ignore[no-untyped-def]
    """Partial derivatives of the force at one instant, where the acceleration is ``a``."""
    fx, fv, fr, fm, fk = partials.in_motion(
        t, x, v, direction, law.friction, law.duration, law.mass, law.stiffness, p, steps
    )
    out[DISPLACEMENT] = fx + law.stiffness * (math.cos(x) if law.pendulum else 1.0)
    out[VELOCITY] = fv
    out[FRICTION] = fr + direction
    out[MASS] = fm + a
    out[STIFFNESS] = fk + (math.sin(x) if law.pendulum else x)
    for c in range(forcing.size):
        if OWN <= forcing[c] < out.size - 1:
            out[forcing[c]] = partials.in_parameter(
                t,
                x,
                v,
                direction,
                law.friction,
                law.duration,
                law.mass,
                law.stiffness,
                p,
                forcing[c] - OWN,
            )


@njit(nogil=True, fastmath=_FAST)
def _solve(matrix, columns):  # type: ignore[no-untyped-def]
    """Solve for every column in place; the matrix, close to one, needs no pivots."""
    m = columns.shape[1]
    for i in range(NODES):
        for k in range(i + 1, NODES):
            factor = matrix[k, i] / matrix[i, i]
            for j in range(i + 1, NODES):
                matrix[k, j] -= factor * matrix[i, j]
            for c in range(m):
                columns[k, c] -= factor * columns[i, c]
    for i in range(NODES - 1, -1, -1):
        for c in range(m):
            total = columns[i, c]
            for j in range(i + 1, NODES):
                total -= matrix[i, j] * columns[j, c]
            columns[i, c] = total / matrix[i, i]


@njit(nogil=True, fastmath=_FAST)
def columns_over_step(  # type: ignore[no-untyped-def]
    force, partials, law, p, columns, samples, first, last, t, x, v, direction, h, dense_x, dense_v
):
    """Carry the columns over the step ``h`` from ``t, x, v``, and fill those of its samples.

    Parameters
    ----------
    force, partials : callable
        The force, and its partial derivatives.
    law : Law
    p : tuple of float
    columns : Columns
    samples : Samples
        Those from ``first`` up to ``last`` lie within the step.
    direction : float
    dense_x, dense_v : ndarray, shape (DENSE,)
        The dense output of the step.
    """
    out, order, forcing, column_x, column_v, gradient, steps, slopes, coefficients, matrix = columns
    time, displacement, velocity, accelerations = samples
    m = column_x.size
    for i in range(NODES):
        s = _NODES[i]
        node_t, node_x, node_v = t + s * h, dense_value(s, x, dense_x), dense_value(s, v, dense_v)
        a = 0.0
        if steps[MASS] != 0.0:
            a = acceleration(force, law, p, node_t, node_x, node_v, direction)
        _fill_gradient(partials, law, p, steps, forcing, gradient, node_t, node_x, node_v, direction, a)
        ax, av = -gradient[DISPLACEMENT] / law.mass, -gradient[VELOCITY] / law.mass
        for j in range(NODES):
            matrix[i, j] = -h * (h * ax * _TWICE[i, j] + av * _ONCE[i, j])
        matrix[i, i] += 1.0
        for c in range(m):
            moved = column_x[c] + s * h * column_v[c]
            slopes[i, c] = ax * moved + av * column_v[c] - gradient[forcing[c]] / law.mass
    _solve(matrix, slopes)
    for c in range(m):
        for q in range(NODES):
            total = 0.0
            for i in range(NODES):
                total += _COEFFICIENTS[q, i] * slopes[i, c]
            coefficients[c, q] = total
    start = time[0] + t
    for i in range(first, last):
        s = (time[i] - start) / h
        if order == 2:
            _fill_gradient(
                partials,
                law,
                p,
                steps,
                forcing,
                gradient,
                time[i] - time[0],
                displacement[i],
                velocity[i],
                direction,
                accelerations[i],
            )
        for c in range(m):
            if order == 0:
                out[c, i] = _displacement(coefficients, column_x, column_v, c, s, h)
            elif order == 1:
                out[c, i] = _velocity(coefficients, column_v, c, s, h)
            else:
                moved = _displacement(coefficients, column_x, column_v, c, s, h)
                faster = _velocity(coefficients, column_v, c, s, h)
                out[c, i] = _of_acceleration(law, gradient, forcing[c], moved, faster)
    for c in range(m):
        moved = _displacement(coefficients, column_x, column_v, c, 1.0, h)
        column_v[c] = _velocity(coefficients, column_v, c, 1.0, h)
        column_x[c] = moved


@njit(nogil=True, fastmath=_FAST)
def _displacement(coefficients, column_x, column_v, c, s, h):  # type: ignore[no-untyped-def]
    """Column ``c`` of the displacement at the share ``s`` of the step ``h``."""
    total = 0.0
    for q in range(NODES - 1, -1, -1):
        total = total * s + coefficients[c, q] / ((q + 1.0) * (q + 2.0))
    return column_x[c] + s * h * (column_v[c] + s * h * total)


@njit(nogil=True, fastmath=_FAST)
def _velocity(coefficients, column_v, c, s, h):  # type: ignore[no-untyped-def]
    """The same of the velocity."""
    total = 0.0
    for q in range(NODES - 1, -1, -1):
        total = total * s + coefficients[c, q] / (q + 1.0)
    return column_v[c] + s * h * total


@njit(nogil=True)
def _of_acceleration(law, gradient, place, x, v):  # type: ignore[no-untyped-def]
    """A column of the acceleration, from those of displacement and velocity, where the gradient is taken."""
    return -(gradient[DISPLACEMENT] * x + gradient[VELOCITY] * v + gradient[place]) / law.mass


@njit(nogil=True)
def columns_at_start(partials, law, p, columns, first, last, t, x, v, direction, a):  # type: ignore[no-untyped-def]
    """Fill the samples from ``first`` up to ``last``, which lie where a half cycle begins."""
    if first == last:
        return
    _fill_gradient(partials, law, p, columns.steps, columns.forcing, columns.gradient, t, x, v, direction, a)
    for c in range(columns.x.size):
        value = columns.x[c]
        if columns.order == 1:
            value = columns.v[c]
        elif columns.order == 2:
            value = _of_acceleration(law, columns.gradient, columns.forcing[c], columns.x[c], columns.v[c])
        for i in range(first, last):
            columns.out[c, i] = value


@njit(nogil=True)
def columns_at_turn(force, law, p, columns, t, x, direction, before):  # type: ignore[no-untyped-def]
    """Carry the columns over a velocity zero at ``t, x``, from where it goes on in ``direction`` or sticks.

    ``before`` is the acceleration before it; zero for a release from rest, which changes nothing.
    """
    factor = 0.0
    if direction != 0.0:
        factor = acceleration(force, law, p, t, x, 0.0, direction) / before if before != 0.0 else 1.0
    for c in range(columns.v.size):
        columns.v[c] *= factor


@njit(nogil=True)
def columns_at_rest(columns, first, last):  # type: ignore[no-untyped-def]
    """Fill the samples from ``first`` up to ``last``, at which the mass sticks."""
    for c in range(columns.x.size):
        for i in range(first, last):
            columns.out[c, i] = columns.x[c] if columns.order == 0 else 0.0
