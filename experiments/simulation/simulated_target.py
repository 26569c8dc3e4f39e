"""The posterior of a loop model as a sampler sees it, with the likelihood of the fit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from experiments.simulation.coordinates import prior_precision, support_of
from experiments.simulation.fit import LoopFit
from experiments.simulation.truncated_normal import truncated_draws
from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.loop.data.parameters import FRICTION, SHARED, Coordinate

__all__ = ["block_log_likelihoods", "target_of"]


_DRAWS = 4000


def target_of(fit: LoopFit, seed: int) -> Target:
    """Posterior of a fit's coordinates, cut to the support of the priors.

    The noise scale is integrated out (white noise) or at its best (with outliers or
    clipped samples), as in the fit itself.

    Parameters
    ----------
    fit : LoopFit
    seed : int
        Of the draws from the normal approximation that give centre and covariance.
    """
    rng = np.random.default_rng(seed)
    draws = truncated_draws(fit.centre[0], fit.covariance, *support_of(fit.model), rng, _DRAWS)
    sampled = _SampledModel(fit)
    return Target(
        names=tuple(_name(c) for c in fit.model.coordinates),
        log_prob=sampled.log_prob,
        closed_form=sampled.closed_form,
        centre=draws.mean(axis=0),
        covariance=np.cov(draws, rowvar=False),
        posterior=sampled.posterior,
        log_prior=sampled.log_prior,
        pointwise=sampled.pointwise,
        predictive=sampled.predictive,
        prior_draws=sampled.prior_draws,
        observed=fit.model.segments[0].values,
        observed_name="signal",
    )


@dataclass(frozen=True, eq=False)
class _SampledModel:
    """The posterior of a fit's coordinates ``z``, shape (m, d), as functions of them."""

    fit: LoopFit

    def _inside(self, z: Array) -> Mask:
        low, high = support_of(self.fit.model)
        return np.asarray(np.all((z >= low) & (z <= high), axis=1))

    def log_prior(self, z: Array) -> Array:
        return np.where(self._inside(z), -0.5 * (z * z) @ prior_precision(self.fit.model), -np.inf)

    def log_prob(self, z: Array) -> Array:
        out = self.log_prior(z)
        for i in np.flatnonzero(np.isfinite(out)):
            out[i] -= 0.5 * _deviance(self.fit, z[i])
        return out

    def closed_form(self, z: Array) -> Array:
        away = z - self.fit.z
        square = np.einsum("ij,jk,ik->i", away, self.fit.precision, away)
        return np.where(self._inside(z), -0.5 * square, -np.inf)

    def posterior(self, z: Array) -> dict[str, Array]:
        return {FRICTION: self.fit.model.value(z, FRICTION)}

    def pointwise(self, z: Array) -> Array:
        return block_log_likelihoods(self.fit, z)

    def predictive(self, z: Array, rng: np.random.Generator) -> Array:
        model = self.fit.model
        size = model.segments[0].values.size
        signals = [
            np.full(size, np.nan) if p is None else p.signal for p in (model.predict(one, 0) for one in z)
        ]
        return np.array(signals) + self.fit.noises[0].sd * rng.standard_normal((len(z), size))

    def prior_draws(self, rng: np.random.Generator, n: int) -> Array:
        low, high = support_of(self.fit.model)
        flat = prior_precision(self.fit.model) == 0.0
        least, most = np.where(flat, 0.0, ndtr(low)), np.where(flat, 1.0, ndtr(high))
        u = least + (most - least) * rng.random((n, self.fit.z.size))
        return np.where(flat, u, ndtri(u))


def _name(c: Coordinate) -> str:
    name = f"{c.effect}.{c.name}" if c.effect else f"z_{c.name}"
    return name if c.record == SHARED else f"{name}[{c.record}]"


def _deviance(fit: LoopFit, z: Array) -> float:
    total = 0.0
    for r, segment in enumerate(fit.model.segments):
        prediction = fit.model.predict(z, r)
        if prediction is None:
            return math.inf
        residual, assumed = segment.values - prediction.signal, fit.noise_models[r]
        noise = assumed.fit(residual, segment, fit.model.scales)
        total -= 2.0 * float(assumed.log_densities(residual, segment, noise).sum())
    return total


def block_log_likelihoods(fit: LoopFit, draws: Array) -> Array:
    """Log-likelihood of each half cycle of each record, shape (draws, blocks).

    Half cycles are those of the fitted motion, the same for every draw and every model of the record; a
    tail shorter than half of one goes with its neighbour. The noise scale is at its best for each draw.
    """
    blocks = [_blocks(fit, r) for r in range(len(fit.noises))]
    out = []
    for z in draws:
        row = []
        for r, segment in enumerate(fit.model.segments):
            prediction = fit.model.predict(z, r)
            if prediction is None:
                row.append(np.full(blocks[r].size, -np.inf))
                continue
            residual, assumed = segment.values - prediction.signal, fit.noise_models[r]
            noise = assumed.fit(residual, segment, fit.model.scales)
            each = assumed.log_densities(residual, segment, noise)
            row.append(np.add.reduceat(each, blocks[r]))
        out.append(np.concatenate(row))
    return np.array(out)


def _blocks(fit: LoopFit, r: int) -> Integers:
    """First sample of each half cycle, from the frequency found when the record was cut."""
    segment = fit.model.segments[r]
    half = math.pi / (segment.decay.frequency * segment.decay.step)
    count = max(round(segment.values.size / half), 1)
    return (np.arange(count) * segment.values.size // count).astype(np.int64)
