"""One record under a law and a random force: all sets of linear effects evaluated exactly.

The motion is smoothed, the effects become columns along it, and a regression of the whitened signal on the
whitened columns gives the evidence of every set (see :mod:`friction_bayes.statespace`), in rounds
(:mod:`friction_bayes.loop.infer.settle`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.errors import InputError
from friction_bayes.core.system import Oscillator
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.data.friction import friction_along
from friction_bayes.loop.data.parameters import scales_of
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.impossible import better_but_impossible, impossible
from friction_bayes.loop.infer.knocks import spans_of
from friction_bayes.loop.infer.law_along_motion import LEAST_TURNS, LawAlongMotion
from friction_bayes.loop.infer.noise_kinds import NoiseGrowth, NoiseKinds, evaluate_sensor_noise
from friction_bayes.loop.infer.rounds import Round
from friction_bayes.loop.infer.settle import settle
from friction_bayes.loop.noise.correlated_noise import Colour
from friction_bayes.statespace.force_grid import Posterior
from friction_bayes.statespace.kalman import shown
from friction_bayes.statespace.smoother import SmoothedMotion

__all__ = ["ForceFit", "fit_first_part", "fit_random_force", "force_fit", "too_few_turning_points"]


@dataclass(frozen=True, eq=False)
class ForceFit(LawAlongMotion):
    """Result of the analysis of one record: a law along its motion, with its posterior and its noise.

    Attributes
    ----------
    posterior : Posterior
    coefficients : ndarray, shape (p,)
        Of the best set at the best point.
    motion : SmoothedMotion
        Smoothed with that law.
    sensor_noise : NoiseKinds
        The noise in addition to white.
    impossible : ndarray of bool, shape (m,)
        Sets that are beyond what their priors allow.
    """

    posterior: Posterior
    coefficients: Array
    motion: SmoothedMotion
    sensor_noise: NoiseKinds
    impossible: Mask

    @property
    def forced(self) -> bool:
        """Whether a random force may act."""
        return self.prior.none < 1.0

    @property
    def growth(self) -> NoiseGrowth | None:
        """Growth of the noise with the motion; None where there is rather none."""
        return self.sensor_noise.growth

    @property
    def chosen(self) -> int:
        """The best set."""
        return self.posterior.best.row

    @property
    def residual(self) -> Array:
        """Signal minus law, natural units, shape (n,)."""
        return self.regression.residual(self.coefficients)

    @property
    def smoothed_signal(self) -> Array:
        """The smoothed motion as read by the sensor, natural units, shape (n,)."""
        law = self.law.states @ self.coefficients + self.law.known_states
        away = np.column_stack([self.motion.states[:, :2] - law, self.fluctuation])
        of_law = self.law.known + self.law.sensor @ self.coefficients
        return of_law + shown(away, self.regression.row)

    @property
    def fluctuation(self) -> Array:
        """The random force, natural units, shape (n,)."""
        return self.motion.states[:, 2]

    @property
    def knocks(self) -> list[tuple[int, int]]:
        """First and last sample of each knock."""
        return spans_of(self.clock.jumps)

    def comparable_friction(self, friction: Array) -> float:
        """Friction that a force is compared with, natural units: the median of draws [N or N m].

        For a decay without dry friction, the friction that alone would explain the loss of amplitude.
        """
        median = float(np.median(friction)) / self.law.unit_force
        return max(median, friction_along(self.path))

    @property
    def log_gain(self) -> float:
        """Log evidence with a random force over that without one, both averaged over the sets."""
        points = self.posterior.points
        logs = np.array([logsumexp(point.found.log_weight) + point.log_volume for point in points])
        force = self.posterior.ratio > 0.0
        return float(logsumexp(logs[force]) - logsumexp(logs[~force])) if force.any() else -math.inf

    def under(self, posterior: Posterior, coefficients: Array) -> ForceFit:
        """The same under another posterior, its motion smoothed with the law of these coefficients."""
        motion = self.regression.smoothed(coefficients, posterior.best)
        return replace(self, posterior=posterior, coefficients=coefficients, motion=motion)

    @property
    def noise_sd(self) -> float:
        """Posterior mean of the sd of a value's noise, correlated part included, unit of the signal."""
        return self.posterior.noise_sd * self.record.error.share * self.unit

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
    noise: str = "auto",
) -> ForceFit | None:
    """The analysis of one record, with the effects ``allowed``; None where it has too few turning points.

    Noise of the sensor is white or what it shows ("auto"), white, or coloured where it can be ("ar").
    """
    whole = MovingRecord.of(segment, system, allowed, scales_of((segment,), system), noise=noise)
    return _fit_of(settle(whole))


def fit_first_part(fit: ForceFit, allowed: Sequence[str], samples: int) -> ForceFit | None:
    """The analysis of the first samples of a record that has been analysed as a whole.

    It was recorded through the filter that was found in the whole, or none, corners are as there, and its
    noise is coloured if that was. None where these samples have too few turning points.
    """
    filter_, known = fit.law.filter, fit.record
    noise = "ar" if isinstance(known.error, Colour) else known.noise
    whole = MovingRecord.of(fit.segment, known.system, allowed, known.scales, noise=noise, samples=samples)
    whole = replace(whole, free_corners=known.free_corners)
    if filter_ is not None:
        whole = whole.behind(filter_)
    return _fit_of(settle(whole, filters=False))


def _fit_of(last: Round | None) -> ForceFit | None:
    """The analysis at the end of the rounds of a law, sensor noise other than white included."""
    if last is None:
        return None
    record, found = last.whole.setting_aside(last.ceiling), last.found
    while True:
        along = found.on(record) if last.outliers.any() else found
        best, posterior, sensor_noise = evaluate_sensor_noise(along, found)
        better = better_but_impossible(best, posterior)
        if not better.any():
            return force_fit(best, posterior, posterior.best_law(), sensor_noise)
        found = found.without(better)


def too_few_turning_points(segment: Segment) -> InputError:
    """The error that a record has too few turning points for a law along its motion."""
    return InputError(
        segment.decay.name,
        f"turns fewer than {LEAST_TURNS} times while it moves freely",
        "give a longer free decay, or one released from farther away",
    )


def force_fit(
    found: LawAlongMotion, posterior: Posterior, coefficients: Array, sensor_noise: NoiseKinds
) -> ForceFit:
    """The analysis of a record, its motion smoothed with the law of these coefficients."""
    return ForceFit(
        **{each.name: getattr(found, each.name) for each in fields(LawAlongMotion)},
        posterior=posterior,
        coefficients=coefficients,
        motion=found.regression.smoothed(coefficients, posterior.best),
        sensor_noise=sensor_noise,
        impossible=impossible(found, posterior),
    )
