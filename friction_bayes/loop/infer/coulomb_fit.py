"""Coulomb friction alone, fitted by simulation: the model before, and a motion from which a law may start.

Friction, frequency, and the start and rest position of each record, under white noise: by Levenberg
and Marquardt's method on more and more of the records, so that no cycle is slipped.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.free_decay import no_decay_fits
from friction_bayes.loop.columns.law_columns import LawBefore
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.data.model import LoopModel, Prediction, difference_steps, prediction_derivatives
from friction_bayes.loop.data.parameters import DISPLACEMENT, FRICTION, LOG_FREQUENCY_RATIO, SHARED, VELOCITY
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.law_along_motion import LawAlongMotion
from friction_bayes.loop.infer.normal_above import draws_above
from friction_bayes.loop.noise.likelihood import LEAST_NOISE
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET
from friction_bayes.statespace.smoother import SmoothedMotion

__all__ = ["CoulombFit", "CoulombStart", "coulomb_mode", "coulomb_start", "fit_coulomb", "refitted"]

_STEPS = 25
_SETTLED = 1e-4
"""Squared length of a step, in posterior standard deviations, that ends a fit."""
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-9, 1e8
_DAMPED = 8.0
"""Factor of the damping after a step, up or down."""
_FIRST_PERIODS = 3.0
_GROWTH = 1.7


@dataclass(frozen=True, eq=False)
class CoulombFit:
    """Coulomb friction at one vector of coordinates: of a fit, at the mode of its posterior.

    Attributes
    ----------
    model : LoopModel
    z : ndarray, shape (p,)
    predictions : tuple of Prediction
        Of each record.
    residuals : tuple of ndarray, shape (n,)
        Zero where a sample does not count.
    noise2 : tuple of float
        Variance of the noise of each record, at its best.
    objective : float
        Minus twice the logarithm of the posterior density.
    """

    model: LoopModel
    z: Array
    predictions: tuple[Prediction, ...]
    residuals: tuple[Array, ...]
    noise2: tuple[float, ...]
    objective: float

    @classmethod
    def at(cls, model: LoopModel, z: Array) -> CoulombFit | None:
        """Coordinates are moved within their bounds; None where the motion is not finite."""
        z = model.within_bounds(z)
        # each coordinate has a standard normal prior
        predictions, residuals, noise2, objective = [], [], [], float(z @ z)
        for r, segment in enumerate(model.segments):
            prediction = model.predict(z, r)
            if prediction is None:
                return None
            # flat samples count as measured: that the sensor clips is an effect
            residual = np.where(segment.ignored, 0.0, segment.values - prediction.signal)
            used = max(int(np.count_nonzero(~segment.ignored)), 1)
            least = (LEAST_NOISE * model.scales.signal) ** 2
            predictions.append(prediction)
            residuals.append(residual)
            noise2.append(max(float(residual @ residual) / used, least))
            objective += used * math.log(noise2[-1]) + float(residual @ residual) / noise2[-1]
        return cls(model, z, tuple(predictions), tuple(residuals), tuple(noise2), objective)

    @property
    def free_residuals(self) -> tuple[Array, ...]:
        """Measured minus predicted, of the samples of each record that measure noise."""
        pairs = zip(self.model.segments, self.predictions, strict=True)
        return tuple((segment.values - moved.signal)[segment.free] for segment, moved in pairs)

    def friction(self, rng: np.random.Generator, draws: int) -> Array:
        """Draws of friction [N or N m] by the normal approximation, cut to the support of its prior."""
        low = np.array([c.support[0] for c in self.model.coordinates])
        drawn = draws_above(low, self.z, self.covariance, rng, draws)
        return np.asarray(self.model.value(drawn, FRICTION))

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the coordinates by the curvature here, shape (p, p)."""
        precision, _ = self.curvature(difference_steps(self.curvature(None)[0]))
        return np.asarray(np.linalg.inv(precision))

    def curvature(self, steps: Array | None) -> tuple[Array, Array]:
        """Gauss and Newton's curvature of half the objective, and minus half its gradient."""
        precision, gradient = np.eye(self.z.size), -self.z
        for r, segment in enumerate(self.model.segments):
            columns = prediction_derivatives(self.model, self.z, r, self.predictions[r], steps)
            columns[segment.ignored] = 0.0
            precision += columns.T @ columns / self.noise2[r]
            gradient += columns.T @ self.residuals[r] / self.noise2[r]
        return precision, gradient

    def improved(self, precision: Array, gradient: Array, damping: float) -> tuple[CoulombFit | None, float]:
        """The first better point, the damping raised until there is one, and the damping of the next step.

        None in its place where none is better. A coordinate at a bound stays there while the gradient pushes
        it out, and the others move without it (Bertsekas, SIAM J. Control Optim. 20, 1982).
        """
        low, high = self.model.bounds
        inside = ~((self.z <= low) & (gradient < 0.0) | (self.z >= high) & (gradient > 0.0))
        curvature, slope = precision[np.ix_(inside, inside)], gradient[inside]
        while damping < _MOST_DAMPING:
            z = self.z.copy()
            z[inside] += np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), slope)
            trial = CoulombFit.at(self.model, z)
            if trial is not None and trial.objective < self.objective:
                return trial, max(damping / _DAMPED, _LEAST_DAMPING)
            damping *= _DAMPED
        return None, damping


def fit_coulomb(system: Oscillator, segments: tuple[Segment, ...]) -> CoulombFit:
    """A fit of Coulomb friction alone, the rest position free, under white noise.

    Raises
    ------
    InputError
        If that cannot be fitted.
    """
    fit = coulomb_mode(LoopModel(system, segments, (SENSOR_OFFSET.name,)))
    if fit is None:
        raise no_decay_fits(", ".join(segment.decay.name for segment in segments), system)
    return fit


def coulomb_mode(model: LoopModel) -> CoulombFit | None:
    """The same of a model; None where its motion does not stay finite."""
    return refitted(model, _starting_point(model), 0.0)


def refitted(model: LoopModel, start: Array, share: float) -> CoulombFit | None:
    """A fit of the first part of the records, then more and more of them; None where that fails.

    It begins with a ``share`` of the moving samples, three periods at least.
    """
    fit, z = None, start
    for samples in _growing(model, share):
        fit = _mode_near(CoulombFit.at(model.of_first_samples(samples), z))
        if fit is None:
            return None
        z = fit.z
    return fit


class CoulombStart(NamedTuple):
    """The frequency of the natural units [rad/s], a motion in these, and the Coulomb law that it follows."""

    w0: float
    motion: SmoothedMotion
    law: LawBefore


def coulomb_start(record: MovingRecord) -> CoulombStart | None:
    """The simulated motion of the Coulomb law that fits the samples of a record best.

    None where no such law can be fitted, or its mass does not turn within the samples, or stops: nothing is
    linear about a mass at rest.
    """
    n = record.samples
    model = LoopModel(record.system, (record.segment,), (SENSOR_OFFSET.name,))
    fit = coulomb_mode(model.of_first_samples([n]))
    if fit is None or math.isfinite(fit.predictions[0].stop_time):
        return None
    w0 = record.system.natural_frequency * math.exp(float(fit.model.value(fit.z, LOG_FREQUENCY_RATIO)))
    moved = fit.predictions[0]
    motion = SmoothedMotion(
        states=np.column_stack([moved.displacement, moved.velocity / w0, np.zeros(n)]),
        covariance=np.zeros((n, 3, 3)),
        noise=float(np.std(fit.free_residuals[0])) / w0**record.segment.order,
        force_sd=0.0,
        tau=1.0,
    )
    found = LawAlongMotion.of(record, motion, w0, ())
    if found is None:
        return None
    sizes = np.zeros(len(found.law.columns))
    sizes[found.law.dry_friction] = fit.model.value(fit.z, FRICTION) / found.law.unit_force
    return CoulombStart(w0, motion, found.law.before(sizes, np.zeros(n)))


def _growing(model: LoopModel, share: float) -> Iterator[list[int]]:
    """Samples of each record, more and more, all of them at last."""
    segments = model.segments
    counts = [segment.values.size for segment in segments]
    periods = [2.0 * math.pi / (s.decay.frequency * s.decay.step) for s in segments]
    samples = [
        max(share * s.moving, _FIRST_PERIODS * period) for s, period in zip(segments, periods, strict=True)
    ]
    while any(n < most for n, most in zip(samples, counts, strict=True)):
        yield [min(int(n), most) for n, most in zip(samples, counts, strict=True)]
        samples = [_GROWTH * n for n in samples]
    yield counts


def _mode_near(fit: CoulombFit | None) -> CoulombFit | None:
    """The mode that is reached from a point; None without one, where the motion does not stay finite."""
    steps, damping, length2 = None, _FIRST_DAMPING, math.inf
    for _ in range(_STEPS):
        if fit is None or length2 < _SETTLED:
            return fit
        precision, gradient = fit.curvature(steps)
        steps = difference_steps(precision)
        better, damping = fit.improved(precision, gradient, damping)
        if better is None:
            return fit
        moved = better.z - fit.z
        fit, length2 = better, float(moved @ precision @ moved)
    return fit


def _starting_point(model: LoopModel) -> Array:
    """Rough coordinates of the Coulomb model."""
    decay = model.segments[0].decay
    drops = []
    z = np.zeros(len(model.coordinates))

    def put(value: float, name: str, record: int = SHARED, effect: str = "") -> None:
        j = model.index(name, effect=effect, record=record)
        z[j] = model.coordinates[j].coordinate(value)

    for r, segment in enumerate(model.segments):
        drop, displacement, velocity = _drop_and_state(segment)
        drops.append(drop)
        put(displacement, DISPLACEMENT, r)
        put(velocity, VELOCITY, r)
        if SENSOR_OFFSET.name in model.effects:
            put(segment.decay.rest_position, "offset", r, SENSOR_OFFSET.name)
    put(float(np.median(drops)) * model.system.stiffness, FRICTION)
    put(math.log(decay.frequency / model.system.natural_frequency), LOG_FREQUENCY_RATIO)
    return model.within_bounds(z)


def _drop_and_state(segment: Segment) -> tuple[float, float, float]:
    """Half the loss of amplitude a half cycle (which is r/k), displacement and velocity at the start."""
    decay = segment.decay
    half = max(int(math.pi / (decay.frequency * decay.step)), 2)
    y = (decay.values - decay.rest_position) / decay.frequency**segment.order
    first, last = (float(np.quantile(np.abs(part), 0.97)) for part in (y[: 2 * half], y[-2 * half :]))
    halves = max(decay.values.size / half - 2.0, 1.0)
    drop = max(first - last, 0.02 * first) / (2.0 * halves)
    amplitude = float(np.sqrt(2.0 * np.mean(y[: 2 * half] ** 2)))
    phase = decay.phase
    return drop, amplitude * math.cos(phase), -amplitude * decay.frequency * math.sin(phase)
