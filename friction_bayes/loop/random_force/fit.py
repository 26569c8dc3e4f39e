"""One record under a law and a force that fluctuates: all sets of linear effects weighed exactly.

The motion is smoothed, the effects are evaluated along it, and a regression of the whitened signal on the
whitened columns weighs every set (see :mod:`friction_bayes.estimators.random_force`). A second round does so
along the motion smoothed with the law of the first, in units of the frequency found there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.estimators.random_force.measured_path import MeasuredPath
from friction_bayes.estimators.random_force.posterior import ForcePrior, Posterior, Problem, integrate
from friction_bayes.estimators.random_force.smoothing import Motion, first_motion
from friction_bayes.estimators.random_force.whitening import Clock, Whitened, sensor_row, smooth, whiten
from friction_bayes.loop.parameters import scales_of
from friction_bayes.loop.random_force.columns import LawColumns, law_columns
from friction_bayes.loop.random_force.sets import ColumnSets, column_sets
from friction_bayes.loop.segment import Segment
from friction_bayes.loop.spectral_lines import line_beside_motion
from friction_bayes.mechanics.effects import EFFECTS, Effect, ForceEffect, Scales
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.sensor_drift import SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_hysteresis import SENSOR_HYSTERESIS
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

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
    clock : Clock
    row : ndarray, shape (3,)
    path : MeasuredPath
    law : LawColumns
    sets : ColumnSets
    posterior : Posterior
    coefficients : ndarray, shape (p,)
        Of the best set at the best point.
    chosen : int
        The best set.
    residual : ndarray, shape (n,)
        Signal minus law, natural units.
    motion : Motion
        Smoothed with that law.
    fluctuation, fluctuation_sd : ndarray, shape (n,)
        The random force, natural units.
    """

    segment: Segment
    samples: int
    system: Oscillator
    scales: Scales
    duration: float
    w0: float
    clock: Clock
    row: Array
    path: MeasuredPath
    law: LawColumns
    sets: ColumnSets
    posterior: Posterior
    coefficients: Array
    chosen: int
    residual: Array
    motion: Motion
    fluctuation: Array
    fluctuation_sd: Array

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
        white = whiten(self.residual[:, None], self.clock, self.row, best.ratio, best.tau, keep=True)
        assert white.columns is not None
        return np.asarray(white.columns[:, 0] / best.noise)


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
    effects = tuple(name for name in EFFECTS if name in allowed and along_motion(EFFECTS[name]))
    n = _moving(segment) if samples is None else samples
    scales = scales_of((segment,), system)
    time, order = segment.time[:n], segment.order
    variance = np.where(segment.sides[:n] == 0.0, 1.0, np.inf)
    row = sensor_row(order)
    w0 = segment.decay.frequency
    signal = segment.values[:n] / w0**order
    motion = first_motion(signal, Clock.of(w0 * (time - time[0]), variance), row)
    change = 1.0
    for turn in range(_MOST_ROUNDS):
        clock = Clock.of(w0 * (time - time[0]), variance)
        signal = segment.values[:n] / w0**order
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
        last = turn > 0 and (turn + 1 == _MOST_ROUNDS or abs(change - 1.0) < _SETTLED)
        prior = ForcePrior(centre=_SHARE_OF_FRICTION * friction)
        problem = _problem(law, sets, signal, clock, row, motion)
        posterior = integrate(problem, prior, motion.noise, only_mode=not last)
        coefficients = posterior.best_law()
        best = posterior.best
        residual = signal - law.known - law.sensor @ coefficients
        fluctuation, covariance = smooth(residual[:, None], clock, row, best.ratio, best.tau)
        states = fluctuation[:, :, 0].copy()
        states[:, :2] += law.states @ coefficients + law.known_states
        motion = Motion(
            states=states,
            covariance=covariance * best.noise**2,
            noise=best.noise,
            force_sd=best.ratio * best.noise,
            tau=best.tau,
        )
        if not last:
            change = math.sqrt(max(1.0 + coefficients[law.always[2]], 0.25))
            if line is None:
                white = whiten(residual[:, None], clock, row, best.ratio, best.tau, keep=True).columns
                assert white is not None
                line = line_beside_motion(white[:, 0], segment)
            w0 *= change
            motion.states[:, 1] /= change
            motion.covariance[:, 1, 1] /= change**2
            if order:
                motion.states[:, :2] /= change**order
            continue
        break
    return ForceFit(
        segment=segment,
        samples=n,
        system=system,
        scales=scales,
        duration=segment.duration,
        w0=w0,
        clock=clock,
        row=row,
        path=path,
        law=law,
        sets=sets,
        posterior=posterior,
        coefficients=coefficients,
        chosen=int(np.argmax(best.found.log_weight)),
        residual=residual,
        motion=motion,
        fluctuation=fluctuation[:, 2, 0],
        fluctuation_sd=np.sqrt(motion.covariance[:, 2, 2]),
    )


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


def _problem(
    law: LawColumns, sets: ColumnSets, signal: Array, clock: Clock, row: Array, motion: Motion
) -> Problem:
    """The regression, its record as the residual of a reference law."""
    scale = law.scale
    columns = law.sensor * scale
    target = signal - law.known
    first = whiten(np.column_stack([columns, target]), clock, row, motion.force_sd / motion.noise, motion.tau)
    gram = first.gram[:-1, :-1]
    ridge = 1e-10 * np.diag(np.diag(gram)) + 1e-300 * np.eye(scale.size)
    reference = np.linalg.solve(gram + ridge, first.gram[:-1, -1])
    block = np.column_stack([columns, target - columns @ reference])

    def whiten_at(ratio: float, tau: float) -> Whitened:
        return whiten(block, clock, row, ratio, tau)

    return Problem(
        names=tuple(str(j) for j in range(scale.size)),
        scale=scale,
        positive=law.positive,
        sets=sets.columns,
        log_prior=sets.log_prior,
        reference=np.asarray(reference, dtype=np.float64),
        whiten_at=whiten_at,
    )
