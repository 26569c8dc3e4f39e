"""Each effect of the catalogue as columns along a measured path: forces, sensor effects, lines."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ndtr

from friction_bayes.core.arrays import Array
from friction_bayes.decay.block_means import block_means
from friction_bayes.decay.spectral_lines import LOG_DECAY_TIME, Line
from friction_bayes.loop import settings
from friction_bayes.loop.data.parameters import Coordinate, effect_coordinates
from friction_bayes.mechanics.effects import EFFECTS, Scales, SensorEffect, force_vector
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.second_mode import SECOND_MODE
from friction_bayes.mechanics.integrate import force_along
from friction_bayes.statespace.measured_path import MeasuredPath, Points

__all__ = [
    "NUDGE",
    "OF_LINES",
    "PRIOR_SCORES",
    "ForceColumn",
    "ForceEvaluator",
    "LawColumn",
    "Sampled",
    "SensorColumn",
    "Shape",
    "force_columns",
    "line_columns",
    "sampled",
    "sensor_columns",
]

OF_LINES = (PERIODIC_INTERFERENCE.name, SECOND_MODE.name)
"""Effects that are lines in the spectrum of a law's residual."""
NUDGE = 1e-4
"""Share of the swing over which a force, or a sensor effect, is differenced."""
PRIOR_SCORES = (-1.6, -0.8, 0.0, 0.8, 1.6)
"""Values of a parameter that shapes a term at which it is evaluated first, as normal scores of its prior."""
_SOME = 1000
"""Nodes of a path, at least, by which the coefficients of an effect are recognised."""
_SMALL_SCORES = tuple(0.6 * k for k in range(-4, 5))
"""The same for a prior that begins at zero; friction is the same with twice as many."""


class Shape(NamedTuple):
    """A parameter that shapes a column: the values that it represents.

    Attributes
    ----------
    name : str
    low, high : float
        Ends of its part of the prior, halfway to its neighbours.
    """

    name: str
    low: float
    high: float


@dataclass(frozen=True)
class LawColumn:
    """Description of a column of the law.

    Attributes
    ----------
    kind : str
        ``displacement``, ``velocity`` (of the start), ``stiffness``, ``friction`` or ``effect``; ``filter``
        of the filter that a record went through.
    scale : float
        Prior standard deviation of the coefficient, before it is cut.
    positive : bool
        Whether the coefficient has to be positive.
    effect, parameter : str
        Effect that it belongs to, and the parameter that is its coefficient; a column of friction belongs to
        the effect that bends it.
    shape : tuple of Shape
        Parameters that shape it.
    score : float
        Where these are taken, as a normal score of their priors; zero without one.
    weight : float
        Probability of the values that they represent.
    width : float
        How many times as wide its prior is as the effect states it.
    of_friction : bool
        Whether the coefficient is the parameter times the friction over the one that the column assumes.
    line : Line or None
        That it is the sine or cosine of, as ``parameter`` says; None of any other effect.
    """

    kind: str
    scale: float
    positive: bool = False
    effect: str = ""
    parameter: str = ""
    shape: tuple[Shape, ...] = ()
    score: float = 0.0
    weight: float = 1.0
    width: float = 1.0
    of_friction: bool = False
    line: Line | None = None

    @property
    def own(self) -> bool:
        """Whether each record has a coefficient of its own: of its start, zero, filter and of what restarts.

        An effect of one sign, such as backlash, is of the sensor and the same in all records.
        """
        if self.kind == "effect":
            return EFFECTS[self.effect].per_record and not self.positive
        return self.of_recording or self.kind in ("displacement", "velocity", "filter")

    @property
    def of_recording(self) -> bool:
        """Whether it is of what is recorded alone, and no effect: the zero within a step, and corners."""
        return self.kind in ("step", "corner")

    def in_widths(self) -> Iterator[LawColumn]:
        """The column in each of the widths of its prior that the effect's series has."""
        for width in EFFECTS[self.effect].widths:
            yield replace(self, scale=width * self.scale, width=width)


@dataclass(frozen=True, eq=False)
class ForceEvaluator:
    """Forces of the catalogue in natural units.

    Attributes
    ----------
    w0 : float
        Frequency of the natural units [rad/s].
    mass, stiffness : float
        Of the oscillator.
    friction : float
        Friction [N or N m] that forces refer to.
    bent : float
        Friction [N or N m] at which one that an effect bends is evaluated.
    duration : float
        Of the record [s], to which friction drift refers.
    """

    w0: float
    mass: float
    stiffness: float
    friction: float
    bent: float
    duration: float

    def at(self, values: Mapping[str, tuple[float, ...]], points: Points, friction: float) -> Array:
        """Forces, on the side of the motion's own acceleration, shape (m,)."""
        force = force_along(tuple(values))(
            points.phase,
            np.ascontiguousarray(points.x),
            np.ascontiguousarray(points.v),
            np.ascontiguousarray(points.direction, dtype=np.float64),
            self.w0,
            friction,
            self.duration,
            self.mass,
            self.stiffness,
            force_vector(values),
        )
        return np.asarray(force)

    @property
    def unit_force(self) -> float:
        return self.mass * self.w0**2


class ForceColumn(NamedTuple):
    """A column of the law and the force of its unit coefficient at points, shape (m,), natural units.

    What shapes the force is at a normal score of its prior.
    """

    column: LawColumn
    shaped: Callable[[Points, float], Array]

    def force(self, points: Points) -> Array:
        """Force of the unit coefficient at points, shape (m,), natural units."""
        return self.shaped(points, self.column.score)


def force_columns(
    name: str,
    scales: Scales,
    evaluator: ForceEvaluator,
    path: MeasuredPath,
    scores: Sequence[float] | None = None,
) -> Iterator[ForceColumn]:
    """Columns of a force effect: one for each coefficient, in each of its shapes.

    The first parameter is a coefficient, or bends friction; another is one if it makes a force by itself
    along the ``path``. Shape parameters are evaluated at evenly spaced normal ``scores`` of the prior, by
    default over all of it.
    """
    coordinates = effect_coordinates(name, scales, 1)
    first, *others = coordinates

    def acting(
        points: Points, score: float = 0.0, *, which: Coordinate, value: float, friction: float = 1.0
    ) -> Array:
        values = tuple(
            value if c is which else 0.0 if c in coefficients else c.at_score(score) for c in coordinates
        )
        return evaluator.at({name: values}, points, friction * evaluator.friction)

    # what kind of force it is shows in a part of them
    some = slice(None, None, max(path.node_phase.size // _SOME, 1))
    nodes, coefficients = Points(*(each[some] for each in path.nodes)), [first]
    coefficients += [c for c in others if acting(nodes, which=c, value=c.prior.scale).any()]
    size = first.prior.scale
    base = acting(nodes, which=first, value=size)
    if not _same_force(acting(nodes, which=first, value=2.0 * size), 2.0 * base):
        yield from _bent_friction(name, first, scales, evaluator, scores)
        return
    of_friction = not _same_force(acting(nodes, which=first, value=size, friction=2.0), base)
    shaping = [c for c in others if c not in coefficients]
    plain = LawColumn("effect", 1.0, effect=name, of_friction=of_friction)
    for shaped in _in_shapes(plain, shaping, PRIOR_SCORES, scores) if shaping else (plain,):
        for c in coefficients:
            own = replace(shaped, scale=c.prior.scale, positive=c.prior.low == 0.0, parameter=c.name)
            for widened in own.in_widths():
                yield ForceColumn(widened, partial(acting, which=c, value=1.0))


def _same_force(one: Array, other: Array) -> bool:
    """Whether two forces are equal except for rounding, relative to the largest value."""
    return bool(np.max(np.abs(one - other)) <= 1e-6 * np.max(np.abs(other)))


def _in_shapes(
    column: LawColumn, shaping: Sequence[Coordinate], prior: Sequence[float], scores: Sequence[float] | None
) -> Iterator[LawColumn]:
    """The column with its ``shaping`` parameters at each of some normal scores, by default of the ``prior``.

    Parameters that shape the same term are at the same score, and share its probability.
    """
    taken = np.array(prior if scores is None else scores)
    half = 0.5 * (taken[1] - taken[0])
    edges = np.append(taken - half, taken[-1] + half)
    # by the nearer tail: probabilities next to one are rounded
    mass = np.where(edges[:-1] > 0.0, -np.diff(ndtr(-edges)), np.diff(ndtr(edges)))
    if scores is None:
        mass /= mass.sum()

    for score, low, high, weight in np.column_stack([taken, edges[:-1], edges[1:], mass]).tolist():
        shape = tuple(Shape(c.name, c.at_score(low), c.at_score(high)) for c in shaping)
        yield replace(column, shape=shape, score=score, weight=weight)


def _bent_friction(
    name: str,
    first: Coordinate,
    scales: Scales,
    evaluator: ForceEvaluator,
    scores: Sequence[float] | None,
) -> Iterator[ForceColumn]:
    """Coulomb friction and a term of fixed size in one column, whose coefficient is the friction."""
    amplitude = scales.amplitude * (scales.system.natural_frequency / evaluator.w0) ** scales.quantity.order
    unit = evaluator.unit_force / evaluator.bent

    def bent(points: Points, score: float) -> Array:
        values = {name: (first.at_score(score),)}
        return unit * evaluator.at(values, points, evaluator.bent) - points.direction

    size = settings.SETTINGS.friction_share * amplitude
    column = LawColumn("friction", size, positive=True, effect=name, parameter=first.name)
    for shaped in _in_shapes(column, (first,), _SMALL_SCORES, scores):
        yield ForceColumn(shaped, bent)


class Sampled(NamedTuple):
    """The motion along a path as a sensor reads it.

    Attributes
    ----------
    phase, signal : ndarray, shape (n block,)
        Natural units; of an acceleration what the restoring force makes.
    block : int
        Readings that each value of the record is the mean of.
    """

    phase: Array
    signal: Array
    block: int

    @property
    def values(self) -> Array:
        """The signal as recorded, shape (n,)."""
        return block_means(self.signal, self.block)


def sampled(path: MeasuredPath, block: int, order: int) -> Sampled:
    """The readings within the blocks of a path by a sensor of the derivative ``order``."""
    if block == 1:
        return Sampled(path.phase, path.reading(order, path.x, path.v), block)
    # an effect that jumps within a block shows there with a share of its size
    within = (np.arange(block) - 0.5 * (block - 1)) / block
    phase = (path.phase[:, None] + np.gradient(path.phase)[:, None] * within).ravel()
    motion = CubicHermiteSpline(path.phase, path.x, path.v)
    return Sampled(phase, path.reading(order, motion(phase), motion(phase, 1)), block)


class SensorColumn(NamedTuple):
    """A column of a sensor effect, and the error of each reading under its unit coefficient, (n block,)."""

    column: LawColumn
    wrong: Callable[[Sampled], Array]

    def error(self, read: Sampled) -> Array:
        """Error of each value of the record, shape (n,)."""
        return block_means(self.wrong(read), read.block)

    def slope(self, read: Sampled) -> Array:
        """Derivative of the error in the signal, shape (n,): zero where it is only late, or jumps."""
        nudge = NUDGE * float(np.max(np.abs(read.signal)))
        above, below = (self.wrong(read._replace(signal=read.signal + off)) for off in (nudge, -nudge))
        return block_means((above - below) / (2.0 * nudge), read.block)


def sensor_columns(
    name: str, scales: Scales, order: int, w0: float, size: float | None
) -> Iterator[SensorColumn]:
    """Columns of a sensor effect that is linear in its parameters, or in the first about its ``size``.

    The size is the scale of its prior where no estimate exists yet.
    """
    effect = EFFECTS[name]
    assert isinstance(effect, SensorEffect)
    unit, distort = w0**order, effect.distort

    def wrong(read: Sampled, *, scale: float, values: Sequence[float]) -> Array:
        clean = unit * read.signal
        time = (read.phase - read.phase[0]) / w0
        return np.asarray((distort(clean, time, *values) - clean) / (unit * scale))

    coordinates = effect_coordinates(name, scales, 1)
    shapes: tuple[tuple[float, ...], ...] = ((),)
    if effect.shapes is not None:
        shapes = effect.shapes(coordinates[0].prior.scale if size is None else size)
    sizes = coordinates[: len(coordinates) - len(shapes[0])]
    for taken in shapes:
        shaping = zip(coordinates[len(sizes) :], taken, strict=True)
        shape = tuple(Shape(c.name, value, value) for c, value in shaping)
        for j, c in enumerate(sizes):
            values = [0.0] * len(sizes)
            values[j] = c.prior.scale
            column = LawColumn(
                "effect",
                c.prior.scale,
                positive=c.prior.low == 0.0,
                effect=name,
                parameter=c.name,
                shape=shape,
                weight=1.0 / len(shapes),
            )
            error = partial(wrong, scale=c.prior.scale, values=(*values, *taken))
            for widened in column.in_widths():
                yield SensorColumn(widened, error)


def line_columns(
    line: Line, scales: Scales, path: MeasuredPath, order: int, w0: float
) -> Iterator[tuple[LawColumn, Array]]:
    """Sine and cosine of a line."""
    scale = EFFECTS[line.effect].priors(scales)[0].scale
    time = path.phase / w0
    shape = _shape_of_line(line, float(time[-1]))
    for part, wave in line.waves(time).items():
        column = LawColumn("effect", scale, effect=line.effect, parameter=part, shape=shape, line=line)
        yield column, wave / w0**order


def _shape_of_line(line: Line, duration: float) -> tuple[Shape, ...]:
    f, t = line.frequency, line.decay_time
    if line.steady:
        # a line off by more than a quarter of a turn over the record would be another one
        return (Shape("frequency", f - 0.25 / duration, f + 0.25 / duration),)
    # uniform of the same standard deviation; that of the frequency is the same share of its half width
    reach = min(math.sqrt(3.0) * line.scatter, LOG_DECAY_TIME)
    apart = reach * line.half_width
    return (
        Shape("frequency", f - apart, f + apart),
        Shape("decay_time", t * math.exp(-reach), t * math.exp(reach)),
    )
