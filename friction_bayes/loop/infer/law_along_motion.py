"""The law of a record along a motion: columns, their sets and regression in one round of an analysis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.decay.spectral_lines import Line
from friction_bayes.loop import settings
from friction_bayes.loop.columns.column_sets import column_sets
from friction_bayes.loop.columns.law_columns import LawBefore, LawColumns, law_columns
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.data.friction import friction_along
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.noise.likelihood import LeftOut
from friction_bayes.mechanics.effects import EFFECTS, SensorEffect
from friction_bayes.statespace.force_prior import ForcePrior, GridPoint
from friction_bayes.statespace.kalman import Clock
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.response import response_at_sensor
from friction_bayes.statespace.smoother import SmoothedMotion

__all__ = ["LEAST_TURNS", "LawAlongMotion", "force_prior"]

LEAST_TURNS = 2
"""Least number of turning points, between which a law has a whole half cycle."""


@dataclass(frozen=True, eq=False)
class LawAlongMotion:
    """The law of a record along a motion.

    Attributes
    ----------
    record : MovingRecord
        Without the samples that are set aside.
    w0 : float
        Frequency of the natural units [rad/s].
    path : MeasuredPath
    law : LawColumns
    sets : tuple of frozenset of str, length m
        Effects of each set of columns.
    regression : LawRegression
    prior : ForcePrior
    """

    record: MovingRecord
    w0: float
    path: MeasuredPath
    law: LawColumns
    sets: tuple[frozenset[str], ...]
    regression: LawRegression
    prior: ForcePrior

    @classmethod
    def of(
        cls,
        record: MovingRecord,
        motion: SmoothedMotion,
        w0: float,
        lines: Sequence[Line],
        *,
        friction: float | None = None,
        about: LawBefore | None = None,
    ) -> LawAlongMotion | None:
        """The law of a record along a motion in units of ``w0`` [rad/s]; None with too few turning points.

        Of several lines of an effect the strongest comes first. A rough ``friction``, natural units, is what
        explains the loss of amplitude by default. Columns are linear ``about`` a law; forces along the motion
        alone by default.
        """
        x, v = motion.states[:, :2].T.copy()
        pendulum = record.system.pendulum
        path = MeasuredPath.through(record.phase(w0), x, v, motion.velocity_sd, pendulum=pendulum)
        if path.turning.size < LEAST_TURNS:
            return None
        rough = friction_along(path) if friction is None else friction
        law = law_columns(path, record, w0=w0, friction=rough, lines=lines, about=about)
        clock = record.clock_along(path, law.feedback, w0)
        sets, columns, log_prior = column_sets(law, record.effects)
        regression = LawRegression(
            clock=clock,
            row=law.row,
            names=tuple(str(j) for j in range(len(law.columns))),
            columns=law.sensor,
            states=law.states,
            known_states=law.known_states,
            target=record.signal(w0) - law.known,
            scale=np.array([column.scale for column in law.columns]),
            positive=np.array([column.positive for column in law.columns]),
            sets=columns,
            log_prior=log_prior,
            stiffness=law.stiffness,
            motion=motion,
            least_noise=max(record.least_noise / w0**record.segment.order, record.error.least_noise),
        )
        prior = force_prior(rough)
        # a random force with coloured noise would count twice: both explain what is not white
        may_act = record.forced and clock.autoregression is None
        return cls(record, w0, path, law, sets, regression, prior if may_act else prior.without_force)

    @property
    def segment(self) -> Segment:
        """The samples of the record, and what is known of them."""
        return self.record.segment

    def shown(self, at_nodes: Array, at_samples: Array) -> Array:
        """What the record shows, shape (n, f), of forces along the motion, shape (nodes, f) and (n, f)."""
        feedback, row = self.law.feedback, self.regression.row
        answered = response_at_sensor(self.path, row, at_nodes, at_samples, feedback=feedback)[1]
        return self.law.recorded(answered)

    @property
    def clock(self) -> Clock:
        """Time stamps and which samples are used."""
        return self.regression.clock

    @property
    def unit(self) -> float:
        """Unit of the signal in natural units."""
        return float(self.w0**self.segment.order)

    @property
    def lines(self) -> tuple[Line, ...]:
        """Lines that may be there, the strongest of each effect first."""
        return tuple(dict.fromkeys(c.line for c in self.law.columns if c.line is not None))

    @cached_property
    def problem(self) -> Problem:
        """The regression of this record alone."""
        return Problem.of(self.regression)

    def without(self, sets: Mask) -> LawAlongMotion:
        """The same without the sets, ``sets`` of shape (m,), which have no prior probability then."""
        log_prior = np.where(sets, -np.inf, self.regression.log_prior)
        return replace(self, regression=replace(self.regression, log_prior=log_prior))

    def on(self, record: MovingRecord) -> LawAlongMotion:
        """The same law of the record with other noise of its samples, or other jumps of the force."""
        clock = record.clock_along(self.path, self.law.feedback, self.w0)
        return replace(self, record=record, regression=replace(self.regression, clock=clock))

    def left_out(self, law: Array, force: GridPoint) -> LeftOut:
        """The samples, each predicted from all others by coefficients (p,) and a random force."""
        error, variance = self.regression.left_out(law, force.ratio, force.tau)
        scales, error = self.record.scales, self.unit * error
        return LeftOut(segment=self.segment, scales=scales, error=error, variance=variance)

    @property
    def determined(self) -> bool:
        """Whether more samples are fitted than there are columns."""
        return int(np.count_nonzero(self.clock.used)) > len(self.law.columns)

    @property
    def of_sensor(self) -> Mask:
        """Columns of sensor effects, shape (p,)."""
        return np.array([isinstance(EFFECTS.get(c.effect), SensorEffect) for c in self.law.columns])

    def sensor_errors(self, sizes: Array) -> Array:
        """Errors of the samples by sensor effects of some sizes, natural units, shape (n,).

        They follow the motion: one that jumps where the motion turns moves with the turning points.
        """
        return np.asarray(self.law.sensor[:, self.of_sensor] @ sizes)


def force_prior(friction: float) -> ForcePrior:
    """Prior of the random force, given a rough friction, natural units."""
    return ForcePrior(centre=settings.SETTINGS.force_share * friction)
