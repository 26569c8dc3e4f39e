"""One record under a law and a force that fluctuates: all sets of linear effects weighed exactly.

The motion is smoothed, the effects are evaluated along it, and a regression of the whitened signal on the
whitened columns weighs every set (see :mod:`friction_bayes.estimators.random_force`). A second round does so
along the motion smoothed with the law of the first, in units of the frequency found there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array
from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.core.system import Oscillator
from friction_bayes.estimators.random_force.law_regression import LawRegression, frequency_change
from friction_bayes.estimators.random_force.measured_path import MeasuredPath
from friction_bayes.estimators.random_force.posterior import ForcePrior, Posterior, integrate
from friction_bayes.estimators.random_force.smoothing import Motion, first_motion
from friction_bayes.estimators.random_force.whitening import Clock, sensor_row
from friction_bayes.loop.parameters import scales_of
from friction_bayes.loop.random_force.columns import LawColumns, law_columns
from friction_bayes.loop.random_force.sets import ColumnSets, column_sets
from friction_bayes.loop.random_force.timing import TimingJitter, find_timing_jitter
from friction_bayes.loop.segment import Segment
from friction_bayes.loop.spectral_lines import line_beside_motion
from friction_bayes.mechanics.effects import EFFECTS, Effect, ForceEffect, Scales, SensorEffect
from friction_bayes.mechanics.effects.encoder_eccentricity import ENCODER_ECCENTRICITY
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.sensor_drift import SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_hysteresis import SENSOR_HYSTERESIS
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET
from friction_bayes.mechanics.effects.timing_jitter import TIMING_JITTER

__all__ = ["ForceFit", "along_motion", "fit_random_force"]

_MOST_ROUNDS = 4
_SETTLED = 2e-3
"""Correction of the stiffness above which the effects are evaluated once more."""
_SHARE_OF_FRICTION = 0.2
"""Median of the prior of the force's sd, in frictions that alone explain the loss of amplitude."""
_LEAST_TURNS = 4
_LINEAR_FAULTS = (
    SENSOR_OFFSET.name,
    SENSOR_DRIFT.name,
    SENSOR_HYSTERESIS.name,
    ENCODER_ECCENTRICITY.name,
    PERIODIC_INTERFERENCE.name,
)


def along_motion(effect: Effect) -> bool:
    """Whether an effect can be evaluated along a measured motion: forces, and linear faults of the sensor."""
    return isinstance(effect, ForceEffect) or effect.name in _LINEAR_FAULTS


@dataclass(frozen=True, eq=False)
class ForceFit:
    """What the analysis of one record found.

    Attributes
    ----------
    segment : Segment
        The record.
    samples : int
        Samples of it that are used: while it moves.
    system : Oscillator
    scales : Scales
        Of the priors.
    duration : float
        To which friction drift refers [s].
    w0 : float
        Frequency of the natural units [rad/s].
    path : MeasuredPath
    law : LawColumns
    sets : ColumnSets
    regression : LawRegression
        The record on these columns.
    prior : ForcePrior
        Of the random force.
    posterior : Posterior
    coefficients : ndarray, shape (p,)
        Of the best set at the best point.
    motion : Motion
        Smoothed with that law.
    jitter : TimingJitter or None
        Of the sample times; None where it may not act.
    """

    segment: Segment
    samples: int
    system: Oscillator
    scales: Scales
    duration: float
    w0: float
    path: MeasuredPath
    law: LawColumns
    sets: ColumnSets
    regression: LawRegression
    prior: ForcePrior
    posterior: Posterior
    coefficients: Array
    motion: Motion
    jitter: TimingJitter | None

    @property
    def clock(self) -> Clock:
        """Time stamps and which samples are used."""
        return self.regression.clock

    @property
    def row(self) -> Array:
        """Row with which the sensor reads the state, shape (3,)."""
        return self.regression.row

    @property
    def chosen(self) -> int:
        """The best set."""
        return int(np.argmax(self.posterior.best.found.log_weight))

    @property
    def residual(self) -> Array:
        """Signal minus law, natural units, shape (n,)."""
        return self.regression.residual(self.coefficients)

    @property
    def fluctuation(self) -> Array:
        """The random force, natural units, shape (n,)."""
        return self.motion.states[:, 2]

    @property
    def fluctuation_sd(self) -> Array:
        """Its standard deviation, shape (n,)."""
        return np.asarray(np.sqrt(self.motion.covariance[:, 2, 2]))

    @property
    def unit(self) -> float:
        """Unit of the signal in natural units."""
        return float(self.w0**self.segment.order)

    @property
    def share_of_friction(self) -> float:
        """Sd of the random force over friction, in the best law."""
        best = self.posterior.best
        friction = float(self.coefficients[self.law.frictions].sum())
        return best.ratio * best.noise / max(friction, 1e-300)

    @property
    def log_gain(self) -> float:
        """Log evidence with a random force over that without one, both averaged over the sets."""
        points = self.posterior.points
        logs = np.array([logsumexp(point.found.log_weight) + point.log_volume for point in points])
        force = self.posterior.ratio > 0.0
        return float(logsumexp(logs[force]) - logsumexp(logs[~force])) if force.any() else -math.inf

    @property
    def innovations(self) -> Array:
        """Whitened residuals under the best law, in standard deviations, shape (n,)."""
        best = self.posterior.best
        return self.regression.innovations(self.coefficients, best.ratio, best.tau) / best.noise


def fit_random_force(
    segment: Segment,
    system: Oscillator,
    allowed: Sequence[str],
    *,
    line: float | None = None,
    samples: int | None = None,
) -> ForceFit | None:
    """Analyse one record.

    Parameters
    ----------
    segment : Segment
    system : Oscillator
        The declared system.
    allowed : sequence of str
        Effects that may act.
    line : float, optional
        Frequency of a line of interference that may be there [Hz]; looked for in the innovations of the first
        round when left out.
    samples : int, optional
        Use the first so many alone.

    Returns
    -------
    ForceFit or None
        None where the record holds too few turning points.
    """
    scales = scales_of((segment,), system)
    effects = tuple(
        name
        for name in EFFECTS
        if name in allowed and along_motion(EFFECTS[name]) and _may_act(name, segment, scales)
    )
    n = _moving(segment) if samples is None else samples
    order = segment.order
    variance = np.where(segment.sides[:n] == 0.0, 1.0, np.inf)
    elapsed = segment.time[:n] - segment.time[0]
    row = sensor_row(order)

    def along(motion: Motion, w0: float, line: float | None) -> _Along | None:
        clock = Clock.of(w0 * elapsed, variance)
        x, v = motion.states[:, :2].T.copy()
        path = MeasuredPath.through(clock.phase, x, v, motion.velocity_sd)
        if path.turning.size < _LEAST_TURNS:
            return None
        friction = _friction_of_loss(path)
        law = law_columns(
            path,
            row,
            order,
            system=system,
            scales=scales,
            effects=effects,
            w0=w0,
            friction=friction,
            duration=segment.duration,
            line=line,
        )
        sets = column_sets(law, effects)
        regression = _regression(law, sets, segment.values[:n] / w0**order, clock, row, motion)
        regression = replace(regression, least_noise=segment.least_noise / w0**order)
        return _Along(path, law, sets, regression, ForcePrior(centre=_SHARE_OF_FRICTION * friction))

    w0 = segment.decay.frequency
    about_rest = (segment.values[:n] - segment.decay.rest_position) / w0**order
    motion = first_motion(about_rest, Clock.of(w0 * elapsed, variance), row)
    found = along(motion, w0, line)
    for _ in range(_MOST_ROUNDS - 1):
        if found is None:
            return None
        guessed = integrate(found.regression.problem, found.prior, motion.noise, only_mode=True)
        coefficients, best = guessed.best_law(), guessed.best
        if line is None:
            white = found.regression.innovations(coefficients, best.ratio, best.tau)
            line = line_beside_motion(white, segment)
        change = frequency_change(coefficients[found.regression.stiffness])
        w0 *= change
        motion = found.regression.smoothed(coefficients, best).at_frequency(change)
        found = along(motion, w0, line)
        if abs(change - 1.0) < _SETTLED:
            break
    if found is None:
        return None
    regression, jitter = found.regression, None
    posterior = integrate(regression.problem, found.prior, motion.noise)
    if TIMING_JITTER.name in allowed:
        # the prior is one of the time of a sample: in a mean of a block it counts less
        prior = TIMING_JITTER.priors(scales)[0]
        prior = replace(prior, location=prior.location * w0 / math.sqrt(segment.block))
        jitter = find_timing_jitter(regression, posterior, found.path, order, prior)
        if jitter.found:
            regression = replace(regression, clock=jitter.clock)
            posterior = integrate(regression.problem, found.prior, posterior.best.noise)
    coefficients = posterior.best_law()
    return ForceFit(
        segment=segment,
        samples=n,
        system=system,
        scales=scales,
        duration=segment.duration,
        w0=w0,
        path=found.path,
        law=found.law,
        sets=found.sets,
        regression=regression,
        prior=found.prior,
        posterior=posterior,
        coefficients=coefficients,
        motion=regression.smoothed(coefficients, posterior.best),
        jitter=jitter,
    )


class _Along(NamedTuple):
    """A law along a motion."""

    path: MeasuredPath
    law: LawColumns
    sets: ColumnSets
    regression: LawRegression
    prior: ForcePrior


def _may_act(name: str, segment: Segment, scales: Scales) -> bool:
    effect = EFFECTS[name]
    if not isinstance(effect, SensorEffect):
        return True
    # how far it swings is unknown in volts
    calibrated = effect.quantity is None or segment.decay.unit not in UNCALIBRATED_UNITS
    return calibrated and effect.may_act(scales)


def _moving(segment: Segment) -> int:
    """Samples before the last half cycle where the motion stops: the law of a stuck contact is another."""
    if not segment.decay.stops:
        return segment.moving
    half_cycle = math.pi / (segment.decay.frequency * segment.decay.step)
    return max(segment.moving - int(half_cycle), 2)


def _friction_of_loss(path: MeasuredPath) -> float:
    """Friction that alone would explain the loss of amplitude, natural units."""
    turns = path.turning_x
    middle = float(np.mean(0.5 * (turns[1:] + turns[:-1])))
    amplitudes = np.abs(turns - middle)
    order = np.arange(amplitudes.size) - 0.5 * (amplitudes.size - 1)
    slope = -float(order @ amplitudes) / float(order @ order)
    return max(0.5 * slope, 1e-4 * float(amplitudes.max()) / amplitudes.size)


def _regression(
    law: LawColumns, sets: ColumnSets, signal: Array, clock: Clock, row: Array, motion: Motion
) -> LawRegression:
    return LawRegression(
        clock=clock,
        row=row,
        names=tuple(str(j) for j in range(law.scale.size)),
        columns=law.sensor,
        states=law.states,
        known_states=law.known_states,
        target=signal - law.known,
        scale=law.scale,
        positive=law.positive,
        sets=sets.columns,
        log_prior=sets.log_prior,
        stiffness=law.always[2],
        motion=motion,
    )
