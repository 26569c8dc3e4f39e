r"""What may act in addition to a spring and constant dry friction: other losses, a bent spring, a bent scale.

Each is a force along a path, whose response is a column of the law:

.. math:: -c\,v, \qquad -c\,v|v|, \qquad -c\,g(t/T)\,\mathrm{sign}\,v, \qquad -c\,x^3/A^2, \qquad
          -c\,e^{-(v/v_s)^2}\,\mathrm{sign}\,v, \qquad 2c\,e^{-s/s_0}\,\mathrm{sign}\,v

with ``A`` the largest swing and ``s`` the distance from the last turning point, over which friction turns. A
loss is measured by the share of the whole that it takes, friction being what dry friction alone would have to
be, and of the last two by that friction. All losses resist, but friction may fall or grow with time, along
``g``, a line or a smooth curve of three Legendre polynomials; its mean over the record is what is estimated.
A bent spring takes nothing: the frequency changes with the swing, which passes for pre-sliding where it
cannot be fitted. The last two are evaluated at a few speeds and lengths, each with the derivative in the
logarithm of that as a second column.

No force at all is the bent scale of a sensor, which reads ``y + c y^2 + e y^3``: where it cannot be fitted
its harmonics pass for a random force, or for a filter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations, product
from types import MappingProxyType

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.estimators.envelope.loss_of_amplitude import UNEVEN_PRIOR
from friction_bayes.estimators.noise.added_columns import AddedColumns
from friction_bayes.estimators.noise.smooth_curve import CURVE_SDS, smooth_curve
from friction_bayes.mechanics.effects.cubic_stiffness import CUBIC_STIFFNESS
from friction_bayes.mechanics.effects.friction_drift import FRICTION_DRIFT
from friction_bayes.mechanics.effects.presliding import PRESLIDING
from friction_bayes.mechanics.effects.quadratic_drag import QUADRATIC_DRAG
from friction_bayes.mechanics.effects.sensor_nonlinearity import SENSOR_NONLINEARITY
from friction_bayes.mechanics.effects.stribeck_friction import STRIBECK_FRICTION
from friction_bayes.mechanics.effects.viscous_damping import VISCOUS_DAMPING
from friction_bayes.statespace.measured_path import MeasuredPath, Points
from friction_bayes.statespace.response import response_at_sensor

__all__ = [
    "BENT",
    "DISTINCT",
    "FORCES",
    "LOSSES",
    "SHAPES",
    "falls_faster",
    "moved_shapes",
    "other_force_columns",
    "other_force_sets",
    "repeated",
]

_DAMPING, _DRAG, _DRIFTING, _BENT_SPRING, _BENT_SCALE, _STRIBECK, _PRESLIDING = (
    effect.name
    for effect in (
        VISCOUS_DAMPING,
        QUADRATIC_DRAG,
        FRICTION_DRIFT,
        CUBIC_STIFFNESS,
        SENSOR_NONLINEARITY,
        STRIBECK_FRICTION,
        PRESLIDING,
    )
)
_PROBABILITY = MappingProxyType(
    {
        _DAMPING: 0.15,
        _DRAG: 0.03,
        _DRIFTING: 0.1,
        _BENT_SPRING: 0.03,
        _BENT_SCALE: 0.03,
        _STRIBECK: 0.03,
        _PRESLIDING: 0.03,
    }
)
"""Prior probability of each, whichever others there are: most machines are damped a little, and friction that
falls with time leaves nearly the same amplitudes. With .03 in place of .1 of it, damping is sure where it is
not: of 20 records in which friction falls by 5 % 6 in place of 17 are covered.

With .05 in place of .03 the intervals of 60 plain records are 1.12 in place of 1.09 times as wide, in the
middle, as those of dry friction alone, and of 60 in which damping takes 2 to 15 % of the loss 3.8 in place of
3.3 times; 85 % of the latter are covered by either.
"""
FORCES = tuple(_PROBABILITY)
"""By their names in the catalogue of effects."""
BENT = (_BENT_SPRING, _BENT_SCALE)
LOSSES = tuple(name for name in FORCES if name not in BENT)
"""Those of them that are bent, and those that take energy."""
_MOST_AT_ONCE, _MOST_COLUMNS = 2, 4
"""Of these, and of what describes them: three forces in one decay are no accident, and imitate what none of
them is, as five columns do a random force."""
_SIZES = tuple(UNEVEN_PRIOR)
"""Prior sds of the share of the loss that one of them takes, as probable as each other: few take much. And
those of what is bent over the largest."""
_BENT = 0.05
"""Largest prior sd of the share by which the stiffness changes with the swing, as that of the stiffness, or
the scale of the sensor."""
_SHAPES = MappingProxyType(
    {
        _STRIBECK: {0.05: 0.26, 0.1: 0.35, 0.2: 0.26, 0.4: 0.13},
        _PRESLIDING: {0.005: 0.15, 0.01: 0.2, 0.02: 0.35, 0.04: 0.3},
    }
)
"""Speeds and lengths over the largest of the motion, with their probabilities.

Speeds are log-normal about a tenth, sd one; lengths half-normal of sd a fiftieth.
"""
SHAPES = tuple(value for values in _SHAPES.values() for value in values)
"""Those speeds and lengths, one force after the other."""
_APART = 0.5 * math.log(2.0)
"""Prior sd of the logarithm of one of these about its value."""
_PLAIN = tuple(name for name in FORCES if name not in _SHAPES)
"""Those without a shape, whose columns come first."""
_COLUMNS = MappingProxyType({_DRIFTING: CURVE_SDS.size, _BENT_SCALE: 2})
"""How many columns of these have other than one."""
_OF_PLAIN = tuple(name for name in _PLAIN for _ in range(_COLUMNS.get(name, 1)))
"""Of which of them each column is, but for the prior sds."""
DISTINCT = len(_OF_PLAIN) + 2 * len(SHAPES)
"""Columns but for their prior sds."""


def other_force_columns(
    path: MeasuredPath, row: Array, friction: float, until: float, shapes: tuple[float, ...] = SHAPES
) -> AddedColumns:
    """Columns of these forces along a path, each once for every prior sd.

    Parameters
    ----------
    path : MeasuredPath
        In natural units.
    row : ndarray, shape (3,) or (n, 3)
        With which the sensor reads the state.
    friction : float
        Displacement ``r/k`` that would explain the whole loss, natural units.
    until : float
        Phase at the end of the decay, over which friction has its mean.
    shapes : tuple of float
        Speeds and lengths, as of :data:`SHAPES`; without any, forces that have one are not evaluated.
    """
    power = path.x**2 + path.v**2
    largest = math.sqrt(float(np.max(power)))
    speeds, lengths = np.split(np.array(shapes), [len(_SHAPES[_STRIBECK])])

    def forces(points: Points) -> Array:
        columns = [
            points.v,
            points.v * np.abs(points.v),
            *(smooth_curve(points.phase, until).T * points.direction),
            points.x**3 / largest**2,
        ]
        for speed in speeds:
            square = (points.v / (speed * largest)) ** 2
            higher = np.exp(-square) * points.direction
            columns += [higher, 2.0 * square * higher]
        slid = _slid(path, points)
        for length in lengths:
            lower = -2.0 * np.exp(-slid / (length * largest)) * points.direction
            columns += [lower, slid / (length * largest) * lower]
        return -np.column_stack(columns)

    # friction takes 4 r/k A in a cycle, damping pi c A**2, drag 8/3 c A**3
    damping, drag = 4.0 / (math.pi * float(np.mean(np.sqrt(power)))), 1.5 / float(np.mean(power))
    plain = [friction * damping, friction * drag, *(friction * CURVE_SDS), _BENT, _BENT, _BENT]
    scale = np.array([*plain, *[friction, friction * _APART] * len(shapes)])
    names = (*_OF_PLAIN, *[_STRIBECK] * 2 * speeds.size, *[_PRESLIDING] * 2 * lengths.size)
    of_either_sign = np.array(
        [
            *(name in (_DRIFTING, *BENT) for name in _OF_PLAIN),
            *[False, True] * len(shapes),
        ]
    )
    states, sensor = response_at_sensor(path, row, forces(path.nodes), forces(path.samples))
    # a bent scale moves nothing, and comes before what has a shape
    bent, place = _bent_readings(path, row, friction), sensor.shape[1] - 2 * len(shapes)
    states = np.insert(states, [place] * bent.shape[1], 0.0, axis=2)
    sensor, times = np.insert(sensor, [place] * bent.shape[1], bent, axis=1), len(_SIZES)
    return AddedColumns(
        names=tuple(name for name in names for _ in _SIZES),
        sensor=np.repeat(sensor, times, axis=1),
        states=np.repeat(states, times, axis=2),
        scale=np.outer(scale, _SIZES).ravel(),
        positive=np.repeat(~of_either_sign, times),
    )


def _bent_readings(path: MeasuredPath, row: Array, friction: float) -> Array:
    """Square and cube of what a sensor reads, as large as that, shape (n, 2)."""
    acceleration = -path.restoring(path.x) - friction * path.expected_direction
    read = acceleration if np.any(row[..., 2]) else row[..., 0] * path.x + row[..., 1] * path.v
    largest = float(np.max(np.abs(read)))
    return np.column_stack([read**2 / largest, read**3 / largest**2])


@lru_cache
def other_force_sets(*, shaped: bool = True) -> tuple[Mask, Array]:
    """Which of these columns act together, shape (m, k), and the logarithm of the prior odds, shape (m,).

    None comes first, and has the odds one. Each force has one prior sd, and one shape, at most. Without those
    that have a shape unless ``shaped``.
    """
    times, first = len(_SIZES), 0
    choices: dict[str, list[tuple[list[int], float]]] = {}
    names = FORCES if shaped else _PLAIN
    for name in names:
        own = _PROBABILITY[name]
        log_odds = math.log(own / (1.0 - own) / times)
        blocks = [(range(first + begin, first + end), share) for begin, end, share in _blocks(name)]
        choices[name] = [
            ([times * column + size for column in columns], log_odds + math.log(share))
            for columns, share in blocks
            for size in range(times)
        ]
        first = max(columns.stop for columns, _ in blocks)
    together = [
        chosen
        for count in range(_MOST_AT_ONCE + 1)
        for some in combinations(names, count)
        for chosen in product(*(choices[name] for name in some))
        if sum(len(columns) for columns, _ in chosen) <= _MOST_COLUMNS
    ]
    sets = np.zeros((len(together), times * first), np.bool_)
    for row, chosen in zip(sets, together, strict=True):
        for columns, _ in chosen:
            row[columns] = True
    return sets, np.array([sum(log_odds for _, log_odds in chosen) for chosen in together])


def _blocks(name: str) -> list[tuple[int, int, float]]:
    """Columns of a force that act together, from one to before another, and the probabilities of these."""
    if name == _DRIFTING:
        return [(0, 1, 0.5), (0, CURVE_SDS.size, 0.5)]
    if name == _BENT_SCALE:
        return [(0, _COLUMNS[name], 1.0)]
    shares = _SHAPES.get(name)
    return [(0, 1, 1.0)] if shares is None else [(2 * i, 2 * i + 2, p) for i, p in enumerate(shares.values())]


def repeated(used: Mask) -> int:
    """How many of the columns that are ``used``, shape (k,), are others with another prior sd."""
    times = used.reshape(-1, len(_SIZES)).sum(axis=1)
    return int(np.sum(np.maximum(times - 1, 0)))


def falls_faster(names: Sequence[str], law: Array, scale: Array) -> bool:
    """Whether the amplitude falls faster while it is larger under a law, by the shares that its losses take.

    And not slower, as where friction grows with time, by the first column of that, or at low speed.

    Parameters
    ----------
    names : sequence of str, length p
        Of the columns.
    law, scale : ndarray, shape (p,)
        Their coefficients, and the prior sds of these.
    """
    together = 0.0
    for name in LOSSES:
        own = np.array([each == name for each in names])
        shares = (law[own] / scale[own]).reshape(-1, len(_SIZES)) @ _SIZES
        # of a shape the second column is the derivative, of time the others curve the first
        share = float(np.sum(shares[::2] if name in _SHAPES else shares[:1]))
        together += -share if name in (_STRIBECK, _DRIFTING) else share
    return together > 0.0


def moved_shapes(law: Array, shapes: tuple[float, ...]) -> tuple[float, ...]:
    """The speeds and lengths, those of a law moved by a Gauss-Newton step.

    Each stays near the value whose part of the prior it has: far from all of them the prior has none.

    Parameters
    ----------
    law : ndarray, shape (k,)
        Coefficients of the columns; zero where absent.
    shapes : tuple of float
        Of these columns; as they are where none has a shape.
    """
    size, slope = law.reshape(-1, len(_SIZES)).sum(axis=1)[len(_OF_PLAIN) :].reshape(-1, 2).T
    if size.size == 0:
        return shapes
    moved = np.clip(slope / np.where(size == 0.0, 1.0, size), -2.0 * _APART, 2.0 * _APART)
    near = np.exp(2.0 * _APART)
    return tuple(
        np.clip(np.array(shapes) * np.exp(moved), np.array(SHAPES) / near, np.array(SHAPES) * near).tolist()
    )


def _slid(path: MeasuredPath, points: Points) -> Array:
    """Distance from the last turning point, shape (m,); from the one that a cycle has before the first."""
    start = -math.copysign(math.hypot(path.x[0], path.v[0]), points.direction[0])
    turned = np.append(start, path.turning_x)
    return np.abs(points.x - turned[np.searchsorted(path.turning, points.phase, side="right")])
