"""What a record can tell at best where its force fluctuates: a judge who knows the motion and the noise.

The signal is a linear model along the true motion (:mod:`experiments.blind.along_motion`) and its covariance,
of noise and of the response to the force, a dense matrix.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from experiments.blind.along_motion import (
    FRICTION,
    NUISANCE,
    Array,
    Columns,
    Path,
    covariance,
    effect_columns,
    nuisance_columns,
)
from experiments.blind.disturbed_motion import DisturbedMotion
from experiments.blind.fluctuating import RANDOM_FORCE
from experiments.blind.outliers import deviance_of_outliers
from experiments.blind.sealed import SealedRecord

__all__ = ["Judgement", "judge"]

_SAMPLES_PER_PERIOD = 24
_SUPPORT = {
    "viscous_damping": (0.0, math.inf),
    "quadratic_drag": (0.0, math.inf),
    "asymmetric_friction": (-1.0, 1.0),
    "stribeck_friction": (0.0, 20.0),
    "friction_drift": (-2.0, 2.0),
    "presliding": (0.3, 3.0),
    "sensor_hysteresis": (0.0, math.inf),
}
"""Of coefficients, over that of friction; a contact that springs back does so with all its friction, its
displacement apart."""
_EXCLUSIVE = frozenset({"asymmetric_friction", "sensor_offset", "sensor_drift"})
"""At most one of these: a constant force is a constant displacement."""
_NOISE_EFFECTS = frozenset({"outliers", "timing_jitter", "sensor_clipping"})
"""Seen in the samples' scatter or values, whatever the motion: judged apart."""
_RIVAL_FORCES = ((1.0, 1.0), (0.0, 1.0), (2.0, 1.0), (4.0, 1.0), (1.0, 0.33), (3.0, 0.33))
"""Sizes and correlation times that a rival may give the force, over the true ones; the true ones first."""
_RIDGE = 1e-11  # of columns scaled to one: two that are the same are not inverted


@dataclass(frozen=True)
class Judgement:
    """What the judge says of a record.

    Attributes
    ----------
    loss : float
        Expected deviance that the closest rival set of other effects loses to the truth, whatever force
        it takes; infinite where there is no rival of no more effects.
    rival : frozenset of str
        Who; the set that fits best where several tie.
    force_loss : float
        Expected deviance that the true law loses without a fluctuating force, its noise as large as need be.
    friction_sd : float
        Of friction, relative, with the true set of effects, force and noise known.
    """

    loss: float
    rival: frozenset[str]
    force_loss: float
    friction_sd: float


@dataclass(frozen=True)
class _Fits:
    """Least squares of every set of columns under one covariance, on one Gram matrix.

    Attributes
    ----------
    gram : ndarray
        Of the whitened columns, the true mean last.
    where : dict
        Effect: index arrays of its columns, one a variant.
    """

    gram: Array
    where: dict[str, list[NDArray[np.int64]]]

    def variants(self, effects: frozenset[str]) -> Iterator[tuple[float, Array, NDArray[np.int64]]]:
        """Chi-square, coefficients and columns of each variant of a set."""
        for chosen in product(*(self.where[name] for name in sorted(effects))):
            used = np.concatenate([np.arange(NUISANCE), *chosen])
            normal, right = self.gram[np.ix_(used, used)], self.gram[used, -1]
            scale = 1.0 / np.sqrt(np.diag(normal))
            scaled = normal * np.outer(scale, scale)
            scaled[np.diag_indices(used.size)] += _RIDGE
            solved = np.linalg.solve(scaled, right * scale) * scale
            yield max(float(self.gram[-1, -1] - right @ solved), 0.0), solved, used

    def misfit(self, effects: frozenset[str]) -> float:
        """Lowest chi-square of the variants whose coefficients are all within their support."""
        lowest = math.inf
        for misfit, solved, used in self.variants(effects):
            if misfit < lowest and self._supported(effects, solved, used):
                lowest = misfit
        return lowest

    def _supported(self, effects: frozenset[str], solved: Array, used: NDArray[np.int64]) -> bool:
        friction = solved[FRICTION]
        coefficient = dict(zip(used.tolist(), solved.tolist(), strict=True))
        bounded = (
            (coefficient[index], _SUPPORT[name])
            for name in effects & _SUPPORT.keys()
            for variant in self.where[name]
            if (index := int(variant[0])) in coefficient
        )
        return friction >= 0.0 and all(low * friction <= c <= high * friction for c, (low, high) in bounded)


def _fits(lower: Array, columns: Columns, nuisance: list[Array], mean: Array) -> _Fits:
    where: dict[str, list[NDArray[np.int64]]] = {}
    stacked, at = [np.column_stack(nuisance)], NUISANCE
    for name, variants in columns.items():
        where[name] = []
        for variant in variants:
            where[name].append(np.arange(at, at + variant.shape[1]))
            stacked.append(variant)
            at += variant.shape[1]
    white = solve_triangular(lower, np.column_stack([*stacked, mean]), lower=True)
    return _Fits(white.T @ white, where)


def _rivals(names: list[str], size: int) -> Iterator[frozenset[str]]:
    for n in range(size + 1):
        for chosen in combinations(names, n):
            if len(_EXCLUSIVE & set(chosen)) < 2:
                yield frozenset(chosen)


def _is_truth(rival: frozenset[str], truth: frozenset[str]) -> bool:
    """An offset that does not drift is a drift of rate zero: the truth and one parameter more."""
    still = frozenset("sensor_offset" if name == "sensor_drift" else name for name in rival)
    return rival == truth or ("sensor_offset" in truth and still == truth)


def _loss_of_noise(name: str, sealed: SealedRecord, variance: Array) -> float:
    """Expected deviance lost by who leaves out an effect that shows in the scatter of the samples."""
    parameters = sealed.truth.parameters
    if name == "outliers":
        return deviance_of_outliers(
            sealed.times.size, parameters["outlier_fraction"], parameters["outlier_scale"]
        )
    if name == "timing_jitter":
        return sealed.times.size * float(np.log(variance.mean()) - np.log(variance).mean())
    return math.inf  # flat samples are seen


def judge(sealed: SealedRecord) -> Judgement:
    """What a record of :func:`experiments.blind.fluctuating.draw_fluctuating` can tell.

    A rival has no more effects than the truth (outside the catalogue: up to two), coefficients within their
    support and any of several sizes and correlation times of the force, none included; its noise is as large
    as its misfit asks for.
    """
    truth, motion = sealed.truth, sealed.motion
    assert isinstance(motion, DisturbedMotion)
    parameters = truth.parameters
    stride = max(int(truth.samples_per_period / _SAMPLES_PER_PERIOD), 1)
    order = 2 if truth.quantity == "acceleration" else 0
    times, clean = sealed.times[::stride], sealed.clean[::stride]
    # the first sample stands at the start, where every response is zero
    used = (times < sealed.rest_time) & (np.abs(clean) < parameters.get("clipping_level", math.inf))
    path = Path(motion, times, order)
    x, acceleration = motion.sample(times)
    signal = acceleration if order else x
    variance = np.full(times.size, sealed.noise_sd**2)
    if "timing_jitter" in parameters:
        variance += (np.gradient(signal, times) * parameters["timing_jitter"]) ** 2
    kept = 1.0 - parameters.get("outlier_fraction", 0.0)
    noise = variance / kept / stride
    swing = None
    if truth.quantity == "angle":
        swing = truth.friction / sealed.system["stiffness"] / motion.law.friction
    mean = (path.response(path.law()) + clean - signal)[used]
    columns = {name: [c[used] for c in variants] for name, variants in effect_columns(path, swing).items()}
    nuisance = [column[used] for column in nuisance_columns(path)]

    others = frozenset(truth.visible) - {RANDOM_FORCE}
    scattered = others & _NOISE_EFFECTS
    moving = others - scattered
    lost = sum(_loss_of_noise(name, sealed, variance) for name in scattered)
    size = 2 if truth.outside else len(others)
    share = parameters.get("force_over_friction", 0.0)
    correlation_time = parameters.get("force_correlation_time", 1.0)

    def lower_of(factor: float, time_factor: float) -> Array:
        whole = covariance(
            times, order, factor * share * motion.law.friction, time_factor * correlation_time, noise
        )
        return np.asarray(cholesky(whole[np.ix_(used, used)], lower=True))

    true_lower = lower_of(1.0, 1.0)
    n = true_lower.shape[0]
    true_log = 2.0 * float(np.log(np.diag(true_lower)).sum())
    force_loss, best = 0.0, (math.inf, frozenset[str]())
    friction_sd = math.nan
    forces = _RIVAL_FORCES if share else _RIVAL_FORCES[1:2]
    for factor, time_factor in forces:
        lower = lower_of(factor, time_factor)
        own_log = 2.0 * float(np.log(np.diag(lower)).sum())
        trace = float(np.sum(solve_triangular(lower, true_lower, lower=True) ** 2))
        fits = _fits(lower, columns, nuisance, mean)

        def deviance(misfit: float, own_log: float = own_log, trace: float = trace) -> float:
            return max(n * math.log((trace + misfit) / n) + own_log - true_log, 0.0)

        if factor == 0.0:
            force_loss = deviance(0.0)
        if (factor, time_factor) == forces[0] and moving <= columns.keys():
            _, _, index = min(fits.variants(moving), key=lambda fit: fit[0])
            inverse = np.linalg.pinv(fits.gram[np.ix_(index, index)], hermitian=True, rcond=1e-13)
            friction_sd = math.sqrt(inverse[FRICTION, FRICTION]) / motion.law.friction
        for rival in _rivals(list(columns), size):
            for kept_scatter in {True, False} if scattered else {True}:
                whole = rival | (scattered if kept_scatter else frozenset())
                if len(whole) > size or _is_truth(whole, others):
                    continue
                loss = deviance(fits.misfit(rival)) + (0.0 if kept_scatter else lost)
                best = min(best, (loss, whole), key=lambda pair: pair[0])
    return Judgement(loss=best[0], rival=best[1], force_loss=force_loss, friction_sd=friction_sd)
