"""The law of a motion as columns of a regression: each effect evaluated along the measured path.

Columns are in natural units (see :mod:`friction_bayes.statespace.transition`), their
coefficients are the effects' own parameters in SI units, with the priors of the catalogue. A parameter that
only shapes a term is evaluated at a few values of its prior, one column each. From the second round on they
are linear about the law of the round before and its sensor effects.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.decay.spectral_lines import Line
from friction_bayes.estimators.noise.free_corners import corner_columns, corner_scale
from friction_bayes.estimators.noise.recording_filters import RecordingFilter, behind, own_columns
from friction_bayes.loop import settings
from friction_bayes.loop.columns.effect_columns import (
    NUDGE,
    OF_LINES,
    ForceColumn,
    ForceEvaluator,
    LawColumn,
    Sampled,
    SensorColumn,
    Shape,
    force_columns,
    line_columns,
    sampled,
    sensor_columns,
)
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.mechanics.effects import EFFECTS, ForceEffect, SensorEffect
from friction_bayes.mechanics.effects.curved_sensor_drift import CURVED_SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_drift import SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET
from friction_bayes.statespace.kalman import sensor_row
from friction_bayes.statespace.measured_path import MeasuredPath, Points
from friction_bayes.statespace.response import Feedback, response_at_sensor

__all__ = ["SENSOR_ZERO", "LawBefore", "LawColumns", "law_columns"]

SENSOR_ZERO = frozenset({SENSOR_OFFSET.name, SENSOR_DRIFT.name, CURVED_SENSOR_DRIFT.name})
"""An error of the sensor's zero is combined with every set: nearly every measured record has one."""
_OF_START = 2
"""Columns before those of the forces."""


@dataclass(frozen=True, eq=False)
class LawBefore:
    """A law about which others are linear: its forces and sensor effects, with their coefficients.

    The random force at the samples, shape (n,), does not depend on the motion.
    """

    forces: tuple[tuple[float, ForceColumn], ...]
    of_sensor: tuple[tuple[float, SensorColumn], ...]
    fluctuation: Array

    @property
    def friction(self) -> float:
        """Its dry friction, natural units; zero without."""
        return sum(size for size, each in self.forces if each.column.kind == "friction")

    def gain(self, read: Sampled) -> Array:
        """A change of the signal as read by the sensor with its effects, shape (n,)."""
        gain = np.ones(read.phase.size // read.block)
        for size, each in self.of_sensor:
            gain += size * each.slope(read)
        return gain

    def force(self, points: Points) -> Array:
        """Its force that depends on the motion, shape (m,)."""
        return sum((size * each.force(points) for size, each in self.forces), np.zeros(points.x.size))

    def feedback(self, path: MeasuredPath) -> Feedback:
        """How its force changes with the motion along a path."""
        nudge = NUDGE * float(np.max(np.abs(path.x)))

        def slopes(points: Points, straight: Array) -> Array:
            by_x, by_v = (
                self.force(points._replace(**{name: getattr(points, name) + nudge}))
                - self.force(points._replace(**{name: getattr(points, name) - nudge}))
                for name in ("x", "v")
            )
            # the part of the restoring force that the linear oscillator lacks
            bent = straight - (np.cos(points.x) if path.pendulum else 1.0)
            return np.column_stack([bent + by_x / (2.0 * nudge), by_v / (2.0 * nudge)])

        return Feedback(
            slopes(path.nodes, path.stiffness[path.interval]),
            slopes(path.samples, path.slope),
            self._passed(path),
        )

    def _passed(self, path: MeasuredPath) -> Array:
        """Acceleration after each turning point over the one before it; none where the mass would stick."""
        turning, x = path.turning, path.turning_x
        sample = np.searchsorted(path.phase, turning) - 1
        towards = np.where(path.v[sample] > 0.0, 1.0, -1.0)
        rest = np.interp(turning, path.phase, self.fluctuation) - path.restoring(x)
        still = np.zeros(turning.size)
        before, after = (rest + self.force(Points(turning, x, still, side)) for side in (towards, -towards))
        # it is against the motion before; friction, which resists, makes it smaller after, unless it has not
        # built up
        share = np.divide(after, before, out=np.zeros(turning.size), where=before * towards < 0.0)
        return np.maximum(share, 0.0)


@dataclass(frozen=True, eq=False)
class LawColumns:
    """Columns of a law along one measured path.

    Attributes
    ----------
    columns : tuple of LawColumn, length p
    sensor : ndarray, shape (n, p)
        Each as recorded, natural units.
    states : ndarray, shape (n, 2, p)
        Displacement and velocity of each; zero for a sensor effect.
    forces : ndarray, shape (n, p)
        Force of each, natural units; zero for the start and for a sensor effect.
    read : Sampled
        The motion along the path as the sensor reads it.
    row : ndarray, shape (3,) or (n, 3)
        With which the sensor, with the effects that it had before, reads the state.
    known : ndarray, shape (n,)
        The terms without a coefficient as recorded.
    known_states : ndarray, shape (n, 2)
    acting : tuple of ForceColumn
        The forces behind the columns, which come after the start.
    wrong : tuple of SensorColumn
        The sensor effects behind the columns, which come after those of the forces.
    about : LawBefore or None
        The law about which the columns are linear; None where forces are taken as given along the path.
    feedback : Feedback
        How the forces of that law change with the motion.
    jump_places : ndarray, shape (k,)
        Where among the samples the sensor jumps, as of their indices.
    filter : RecordingFilter or None
        Through which the record went.
    friction : float
        Friction [N or N m] that columns ``of_friction`` assume.
    unit_force : float
        Force of one natural unit [N or N m].
    """

    columns: tuple[LawColumn, ...]
    sensor: Array
    states: Array
    forces: Array
    read: Sampled
    row: Array
    known: Array
    known_states: Array
    acting: tuple[ForceColumn, ...]
    wrong: tuple[SensorColumn, ...]
    about: LawBefore | None
    feedback: Feedback
    jump_places: Array
    filter: RecordingFilter | None
    friction: float
    unit_force: float
    stiffness, dry_friction = _OF_START, _OF_START + 1
    """Columns of the stiffness and of Coulomb friction alone, the first of the forces."""

    def force(self, j: int, points: Points) -> Array:
        """Force of the unit coefficient of a column behind which there is one, shape (m,), natural units."""
        return self.acting[j - _OF_START].force(points)

    def with_sizes(self, coefficients: Array) -> list[tuple[float, ForceColumn]]:
        """The forces of a law of some coefficients, shape (p,), that act, with these."""
        sizes = coefficients[_OF_START : _OF_START + len(self.acting)].tolist()
        return [pair for pair in zip(sizes, self.acting, strict=True) if pair[0] != 0.0]

    def before(self, coefficients: Array, fluctuation: Array) -> LawBefore:
        """The law of some coefficients, shape (p,), in units of the frequency that it found.

        With the random force, shape (n,).
        """
        forces = self.with_sizes(coefficients)
        kept = tuple(pair for pair in forces if pair[1].column.kind != "stiffness")
        sizes = coefficients[self.of_sensor_effects].tolist()
        of_sensor = tuple(pair for pair in zip(sizes, self.wrong, strict=True) if pair[0] != 0.0)
        return LawBefore(kept, of_sensor, fluctuation)

    @property
    def of_sensor_effects(self) -> slice:
        """Columns of sensor effects, except lines."""
        first = _OF_START + len(self.acting)
        return slice(first, first + len(self.wrong))

    @property
    def always(self) -> list[int]:
        """Columns that every set contains: start, stiffness, zero within a step, corners, and of a filter."""
        return [j for j, c in enumerate(self.columns) if c.kind not in ("friction", "effect")]

    @property
    def frictions(self) -> list[int]:
        """The columns of friction, of which a set contains at most one."""
        return [j for j, c in enumerate(self.columns) if c.kind == "friction"]

    @property
    def resisting(self) -> list[int]:
        """Columns of friction and of forces that resist as it does."""
        return [j for j, c in enumerate(self.columns) if j not in self.always and not _of_a_spring(c.effect)]

    def sensor_sizes(self, coefficients: Array) -> dict[str, float]:
        """Size in a law of each sensor effect whose size shapes it, by effect."""
        sizes: dict[str, float] = {}
        for column, size in zip(self.columns, coefficients.tolist(), strict=True):
            effect = EFFECTS.get(column.effect)
            if isinstance(effect, SensorEffect) and effect.shapes is not None and size != 0.0:
                sizes[column.effect] = size
        return sizes

    def with_shown(self, shown: Sequence[tuple[LawColumn, Array]]) -> LawColumns:
        """The same with columns of the recording, shape (n,) each, which do not affect the motion."""
        n, extra = len(self.sensor), len(shown)
        return replace(
            self,
            columns=(*self.columns, *(column for column, _ in shown)),
            sensor=np.column_stack([self.sensor, *(values for _, values in shown)]),
            states=np.concatenate([self.states, np.zeros((n, 2, extra))], axis=2),
            forces=np.column_stack([self.forces, np.zeros((n, extra))]),
        )

    def recorded(self, shown: Array) -> Array:
        """Columns that the sensor reads, as recorded, shape (n, p)."""
        return shown if self.filter is None else behind(shown, self.filter, self.jump_places)

    @property
    def read_with_friction(self) -> Array:
        """The motion along the path as the sensor reads it, with the friction that is assumed, shape (n,)."""
        assumed = self.friction / self.unit_force * self.forces[:, self.dry_friction]
        return np.asarray(self.read.values + self.row[..., 2] * assumed)

    @property
    def moved(self) -> Mask:
        """Which columns, shape (p,), go through a filter: those that are of the motion, not the recording."""
        recorded = [c.of_recording or c.effect in SENSOR_ZERO or c.line is not None for c in self.columns]
        return ~np.array(recorded)

    def behind(self, filter_: RecordingFilter) -> LawColumns:
        """The same after a filter, except lines, the zero of the recording and corners of any shape.

        With what the filter has of the time outside the record, and its doubts.
        """
        moved = np.flatnonzero(self.moved)
        filtered, sensor = replace(self, filter=filter_), self.sensor.copy()
        shown = filtered.recorded(np.column_stack([self.sensor[:, moved], self.known]))
        sensor[:, moved] = shown[:, :-1]
        own = own_columns(filter_, self.read_with_friction).T
        return replace(filtered, sensor=sensor, known=shown[:, -1]).with_shown(
            [(LawColumn("filter", 1.0), each) for each in own]
        )

    def alternatives(self, effect: str) -> list[tuple[int, ...]]:
        """Columns of an effect in each of its shapes and extents; all of its lines are one."""
        found: dict[tuple[tuple[Shape, ...], float], list[int]] = {}
        for j, column in enumerate(self.columns):
            if column.effect == effect:
                found.setdefault((column.shape, column.width), []).append(j)
        if effect in OF_LINES and found:
            return [tuple(chain(*found.values()))]
        series = EFFECTS[effect].series if effect else ()
        if not series:
            return [tuple(columns) for columns in found.values()]
        return [
            tuple(columns[: extent.parameters])
            for (_, width), columns in found.items()
            for extent in series
            if extent.width == width
        ]


def _of_a_spring(name: str) -> bool:
    effect = EFFECTS.get(name)
    return isinstance(effect, ForceEffect) and not effect.resists


def law_columns(
    path: MeasuredPath,
    record: MovingRecord,
    *,
    w0: float,
    friction: float,
    lines: Sequence[Line] = (),
    about: LawBefore | None = None,
) -> LawColumns:
    """Columns of the law along a path in natural units of ``w0`` [rad/s], with a rough friction in these.

    Of several lines of an effect the strongest comes first. Columns are the derivatives of the motion of the
    law ``about`` which the path was smoothed; by default forces are taken as given along the path.
    """
    system, segment, order = record.system, record.segment, record.segment.order
    mass, stiffness = LoopModel(system, (segment,)).mass_and_stiffness(w0 / system.natural_frequency)
    unit = mass * w0**2
    bent = about.friction if about is not None and about.friction > 0.0 else friction
    evaluator = ForceEvaluator(w0, mass, stiffness, friction * unit, bent * unit, segment.duration)
    amplitude = record.scales.amplitude * (system.natural_frequency / w0) ** order
    acting = _acting(path, record, evaluator, amplitude)
    read, row = sampled(path, segment.block, order), sensor_row(order, path.slope)
    gain = np.ones(path.phase.size) if about is None else about.gain(read)
    if np.any(gain != 1.0):
        row = gain[:, None] * row
    answers = _answers(path, row, acting, about)
    start = [
        LawColumn(name, settings.SETTINGS.state_share * amplitude) for name in ("displacement", "velocity")
    ]
    wrong = tuple(_wrong(record, w0))
    law = LawColumns(
        columns=(*start, *(each.column for each in acting)),
        sensor=answers.sensor[:, :-1],
        states=answers.states[:, :, :-1],
        forces=answers.forces[:, :-1],
        read=read,
        row=row,
        # the sensor effects are linear about the path, so that the gain counts a share of it twice
        known=answers.sensor[:, -1] - (gain - 1.0) * read.values,
        known_states=answers.states[:, :, -1],
        acting=tuple(acting),
        wrong=wrong,
        about=answers.about,
        feedback=answers.feedback,
        jump_places=path.jump_places(order),
        filter=None,
        friction=friction * unit,
        unit_force=unit,
    )
    of_lines = chain.from_iterable(line_columns(line, record.scales, path, order, w0) for line in lines)
    shown = [*((each.column, each.error(read)) for each in wrong), *of_lines, _step(record, w0)]
    corners = _corners(path, order, friction) if record.free_corners else ()
    law = law.with_shown([*shown, *corners])
    return law if record.filter is None else law.behind(record.filter)


class _Answers(NamedTuple):
    """Responses to a unit start, to each force and, last, to the known terms; as in LawColumns."""

    about: LawBefore | None
    feedback: Feedback
    forces: Array
    states: Array
    sensor: Array


def _answers(
    path: MeasuredPath, row: Array, acting: Sequence[ForceColumn], about: LawBefore | None
) -> _Answers:
    """The motions of the forces along a path, about a law if the path is a motion of that."""
    feedback = Feedback.none(path) if about is None else about.feedback(path)
    if about is not None and not feedback.bears(path):
        return _answers(path, row, acting, None)
    felt = []
    for points, slope, stiffness in (
        (path.nodes, feedback.nodes, path.stiffness[path.interval]),
        (path.samples, feedback.samples, path.slope),
    ):
        # the restoring force beyond the linear oscillator's, less the linear part of the law along the path
        known = (
            stiffness * points.x - path.restoring(points.x) - slope[:, 0] * points.x - slope[:, 1] * points.v
        )
        none = np.zeros((points.x.size, _OF_START))
        felt.append(np.column_stack([none, *(each.force(points) for each in acting), known]))
    at_nodes, forces = felt
    start = np.eye(2, forces.shape[1])
    states, sensor = response_at_sensor(path, row, at_nodes, forces, start, feedback)
    return _Answers(about, feedback, forces, states, sensor)


def _acting(
    path: MeasuredPath, record: MovingRecord, evaluator: ForceEvaluator, amplitude: float
) -> list[ForceColumn]:
    """Columns of the stiffness, of dry friction and of the forces that may act."""
    names = [name for name in record.effects if isinstance(EFFECTS[name], ForceEffect)]
    return [
        ForceColumn(
            LawColumn("stiffness", settings.SETTINGS.stiffness_sd),
            lambda points, _: -path.restoring(points.x),
        ),
        ForceColumn(
            LawColumn("friction", settings.SETTINGS.friction_share * amplitude, positive=True),
            lambda points, _: -points.direction,
        ),
        *(
            found
            for name in names
            for found in force_columns(name, record.scales, evaluator, path, record.scores.get(name))
        ),
    ]


def _step(record: MovingRecord, w0: float) -> tuple[LawColumn, Array]:
    """The zero of a sensor that counts steps, of which none says whether it is rounded or cut off."""
    order, known_to = record.segment.order, max(record.segment.resolution or 0.0, record.least_noise)
    return LawColumn("step", known_to), np.full(record.samples, w0**-order)


def _corners(path: MeasuredPath, order: int, friction: float) -> Iterator[tuple[LawColumn, Array]]:
    """Corners as a sensor may have made them, see :mod:`friction_bayes.estimators.noise.free_corners`."""
    for scale, column in zip(corner_scale(path, order, friction), corner_columns(path).T, strict=True):
        yield LawColumn("corner", float(scale)), column


def _wrong(record: MovingRecord, w0: float) -> Iterator[SensorColumn]:
    """Columns of the sensor effects that may act, except lines."""
    for name in record.effects:
        if isinstance(EFFECTS[name], SensorEffect) and name not in OF_LINES:
            yield from sensor_columns(name, record.scales, record.segment.order, w0, record.sizes.get(name))
