"""The most a record can show where its force fluctuates: a judge who knows the motion and the noise.

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
    """The judge's results for a record.

    Attributes
    ----------
    loss : float
        Expected deviance that the closest rival set of other effects loses to the truth, whatever force
        it takes; infinite where there is no rival of no more effects.
    rival : frozenset of str
        Who; the set that fits best where several tie.
    force_loss : float
        Expected deviance that the true law, fitted anew, loses without a fluctuating force, its noise as
        large as need be.
    friction_sd : float
        Of friction, relative, with the true set of effects, force and noise known.
    """

    loss: float
    rival: frozenset[str]
    force_loss: float
    friction_sd: float


@dataclass(frozen=True)
class _Variant:
    """One way to have a set of effects, fitted.

    Attributes
    ----------
    misfit : float
        Chi-square of the true mean.
    taken : float
        Part of the expected sum of squares that the coefficients take up.
    log_determinant : float
        Of the Gram matrix.
    coefficients, used : ndarray
        And the columns that they belong to.
    """

    misfit: float
    taken: float
    log_determinant: float
    coefficients: Array
    used: NDArray[np.int64]


@dataclass(frozen=True)
class _Fits:
    """Least squares of every set of columns under one covariance, on one Gram matrix.

    Attributes
    ----------
    gram : ndarray
        Of the whitened columns, the true mean last.
    scatter : ndarray
        True covariance of the products of the whitened columns with the whitened signal.
    trace, log_determinant, samples : float, float, int
        Expected sum of squares of the whitened signal about its mean, log determinant of the covariance.
    where : dict
        Effect: index arrays of its columns, one a variant.
    """

    gram: Array
    scatter: Array
    trace: float
    log_determinant: float
    samples: int
    where: dict[str, list[NDArray[np.int64]]]

    def variants(self, effects: frozenset[str]) -> Iterator[_Variant]:
        """Every variant of a set."""
        for chosen in product(*(self.where[name] for name in sorted(effects))):
            used = np.concatenate([np.arange(NUISANCE), *chosen])
            own, right = np.ix_(used, used), self.gram[used, -1]
            scale = 1.0 / np.sqrt(np.diag(self.gram[own]))
            scaled = self.gram[own] * np.outer(scale, scale)
            scaled[np.diag_indices(used.size)] += _RIDGE
            inverse = np.linalg.inv(scaled) * np.outer(scale, scale)
            solved = inverse @ right
            yield _Variant(
                misfit=max(float(self.gram[-1, -1] - right @ solved), 0.0),
                taken=float(np.sum(inverse * self.scatter[own])),
                log_determinant=float(np.linalg.slogdet(scaled)[1]) - 2.0 * float(np.log(scale).sum()),
                coefficients=solved,
                used=used,
            )

    def supported(self, effects: frozenset[str], variant: _Variant) -> bool:
        """Whether every coefficient is within its support."""
        friction = variant.coefficients[FRICTION]
        coefficient = dict(zip(variant.used.tolist(), variant.coefficients.tolist(), strict=True))
        bounded = (
            (coefficient[index], _SUPPORT[name])
            for name in effects & _SUPPORT.keys()
            for columns in self.where[name]
            if (index := int(columns[0])) in coefficient
        )
        return friction >= 0.0 and all(low * friction <= c <= high * friction for c, (low, high) in bounded)

    def deviance(self, variant: _Variant, true: _Fits, true_variant: _Variant, misfit: float) -> float:
        """Expected restricted deviance of one variant over the same columns under the true covariance.

        Its noise is as large as it has to be; columns take up what they can of the force's response under
        either covariance, so that a force which an initial state or a frequency imitates counts as unseen.
        """
        free = self.samples - variant.used.size
        mean_square = (self.trace - variant.taken + misfit) / free
        volume = variant.log_determinant - true_variant.log_determinant
        excess = self.log_determinant - true.log_determinant
        return max(free * math.log(mean_square) + excess + volume, 0.0)


def _fits(lower: Array, true_lower: Array, columns: Columns, nuisance: list[Array], mean: Array) -> _Fits:
    where: dict[str, list[NDArray[np.int64]]] = {}
    stacked, at = [np.column_stack(nuisance)], NUISANCE
    for name, variants in columns.items():
        where[name] = []
        for variant in variants:
            where[name].append(np.arange(at, at + variant.shape[1]))
            stacked.append(variant)
            at += variant.shape[1]
    white = solve_triangular(lower, np.column_stack([*stacked, mean]), lower=True)
    colour = solve_triangular(lower, true_lower, lower=True)
    products = colour.T @ white[:, :-1]
    return _Fits(
        gram=white.T @ white,
        scatter=products.T @ products,
        trace=float(np.sum(colour**2)),
        log_determinant=2.0 * float(np.log(np.diag(lower)).sum()),
        samples=lower.shape[0],
        where=where,
    )


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
    """Judge what a record of :func:`experiments.blind.fluctuating.draw_fluctuating` can show.

    A rival has no more effects than the truth (outside the catalogue: up to two), coefficients within their
    support and any of several sizes and correlation times of the force, zero included; its noise is as large
    as its misfit requires.
    """
    truth, motion = sealed.truth, sealed.motion
    assert isinstance(motion, DisturbedMotion)
    parameters = truth.parameters
    stride = max(int(truth.samples_per_period / _SAMPLES_PER_PERIOD), 1)
    order = 2 if truth.quantity == "acceleration" else 0
    times, clean = sealed.times[::stride], sealed.clean[::stride]
    # the first sample is at the start, where every response is zero
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
    mode = None
    if "mode_frequency" in parameters:
        mode = (parameters["mode_frequency"], parameters["mode_decay"])
    offered = effect_columns(path, swing, mode)
    columns = {name: [c[used] for c in variants] for name, variants in offered.items()}
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
    true = _fits(true_lower, true_lower, columns, nuisance, mean)
    known = moving if moving <= columns.keys() else frozenset[str]()
    nearest, own = min(enumerate(true.variants(known)), key=lambda pair: pair[1].misfit)
    sd = 1.0 / math.sqrt(_information(true, own)) / motion.law.friction
    force_loss, best = 0.0, (math.inf, frozenset[str]())
    for factor, time_factor in _RIVAL_FORCES if share else _RIVAL_FORCES[:1]:
        fits = true
        if (factor, time_factor) != _RIVAL_FORCES[0]:
            fits = _fits(lower_of(factor, time_factor), true_lower, columns, nuisance, mean)
        if factor == 0.0:
            same = next(v for i, v in enumerate(fits.variants(known)) if i == nearest)
            force_loss = fits.deviance(same, true, own, misfit=0.0)
        for rival in _rivals(list(columns), size):
            loss = min(
                (
                    fits.deviance(variant, true, true_variant, variant.misfit)
                    for variant, true_variant in zip(fits.variants(rival), true.variants(rival), strict=True)
                    if fits.supported(rival, variant)
                ),
                default=math.inf,
            )
            for kept_scatter in {True, False} if scattered else {True}:
                whole = rival | (scattered if kept_scatter else frozenset())
                if len(whole) <= size and not _is_truth(whole, others):
                    best = min(
                        best, (loss + (0.0 if kept_scatter else lost), whole), key=lambda pair: pair[0]
                    )
    return Judgement(
        loss=best[0],
        rival=best[1],
        force_loss=force_loss,
        friction_sd=sd if known == moving else math.nan,
    )


def _information(fits: _Fits, variant: _Variant) -> float:
    """Inverse variance of friction, fitted with the other columns of a variant."""
    used = variant.used
    scale = 1.0 / np.sqrt(np.diag(fits.gram[np.ix_(used, used)]))
    scaled = fits.gram[np.ix_(used, used)] * np.outer(scale, scale)
    inverse = np.linalg.pinv(scaled, hermitian=True, rcond=1e-13)
    return float(1.0 / inverse[FRICTION, FRICTION] / scale[FRICTION] ** 2)
