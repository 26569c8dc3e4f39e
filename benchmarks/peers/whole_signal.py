r"""The posterior of a whole signal: amplitude, phase, frequency, rest position, friction and noise.

The density is that of ``waveform`` (:mod:`friction_bayes.estimators.waveform.normal_equations`) with
:math:`\theta = W s + p`, written once for PyTensor and JAX. All samplers move in coordinates of which the
closed form has zero mean and unit covariance, about where they start.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from benchmarks.peers import samplers
from benchmarks.peers.measuring import bold
from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array
from friction_bayes.decay.free_decay import find_free_decay
from friction_bayes.estimators.waveform.least_squares import fit_waveforms
from friction_bayes.mechanics.testbed import PAPER_FRICTION, PAPER_RELEASE, PAPER_SYSTEM

OURS, PACKAGES, summary = samplers.OURS, samplers.PACKAGES, samplers.effective
DURATION, NOISE = 30.0, 5e-4
"""The paper's example, cut before it comes to rest [s, m]."""
RATE, FAST = 50.0, 1000.0
"""Sampling rates: one at which every sampler takes seconds, and the paper's [1/s]."""
SEED = 1


@cache
def record(rate: float) -> xr.DataArray:
    """The data."""
    return fb.simulate(
        PAPER_SYSTEM,
        friction=PAPER_FRICTION,
        initial_displacement=PAPER_RELEASE,
        duration=DURATION,
        sampling_rate=rate,
        noise_sd=NOISE,
        seed=SEED,
    )


def _estimate(rate: float) -> fb.Estimate:
    return fb.estimate(record(rate), PAPER_SYSTEM, random_force="none")


@dataclass(frozen=True)
class Density:
    """The posterior density, to be written in any array language.

    Attributes
    ----------
    target : Target
        As the package's own sampler sees it.
    observed, places : ndarray, shape (n,)
        Samples, and where they lie between the ends of the record.
    kappa, half_duration : float
        Of the coefficients (see :mod:`friction_bayes.estimators.waveform.normal_equations`) [1, s].
    prior : mapping
        Shape ``alpha`` and scale ``beta`` of the error variance; the coefficients are uniform.
    """

    target: Target
    observed: Array
    places: Array
    kappa: float
    half_duration: float
    prior: Mapping[str, float]

    def coordinates(self, z: Any, language: Any) -> Any:
        """Coordinates of the target, of standardised ones."""
        return self.target.centre + language.dot(np.linalg.cholesky(self.target.covariance), z)

    def log_density(self, at: Any, language: Any) -> Any:
        """Logarithm of the density at coordinates of the target, shape (6,), but for a constant."""
        angle = at[3] * self.half_duration * self.places + at[4]
        half = language.floor(angle / np.pi)
        side = 1.0 - 2.0 * (half % 2.0)
        swing = at[1] + (self.kappa - 2.0 * half - 1.0) * at[2]
        misfit = ((self.observed - at[0] - swing * language.cos(angle) - side * at[2]) ** 2).sum()
        shape = self.prior["alpha"] + 0.5 * self.observed.size
        return -shape * at[5] - (self.prior["beta"] + 0.5 * misfit) * language.exp(-at[5])


@cache
def density(rate: float = RATE) -> Density:
    """The density after the data."""
    estimate, decay = _estimate(rate), find_free_decay(record(rate), PAPER_SYSTEM)
    fits = fit_waveforms(decay.values[None], decay.located, decay.quantity.order, 0.0)
    (part,) = estimate.fit.parts
    return Density(
        target=part.build_target(),
        observed=decay.values,
        places=decay.places,
        kappa=float(fits.kappa[0]),
        half_duration=0.5 * decay.duration,
        prior=estimate.prior,
    )


def _pymc_model(rate: float) -> Any:
    import pymc
    import pytensor.tensor

    given = density(rate)
    with pymc.Model() as model:
        z = pymc.Flat("z", shape=given.target.centre.size)
        at = pymc.Deterministic("coordinates", given.coordinates(z, pytensor.tensor))
        pymc.Potential("density", given.log_density(at, pytensor.tensor))
    return model


def _numpyro_model(rate: float) -> None:
    import jax.numpy
    import numpyro
    from numpyro import distributions

    given, real = density(rate), distributions.constraints.real
    z = numpyro.sample("z", distributions.ImproperUniform(real, (given.target.centre.size,), ()))
    at = numpyro.deterministic("coordinates", given.coordinates(z, jax.numpy))
    numpyro.factor("density", given.log_density(at, jax.numpy))


def _parameters(rate: float, draws: samplers.Draws) -> samplers.Draws:
    at = draws["coordinates"]
    natural = density(rate).target.posterior(at.reshape(-1, at.shape[-1]))
    return {name: each.reshape(at.shape[:-1]) for name, each in natural.items()}


def _ours(rate: float, seed: int) -> xr.DataTree:
    return fb.sample_reference(record(rate), PAPER_SYSTEM, random_force="none", seed=seed, ess=samplers.ESS)


@cache
def posterior(rate: float = RATE) -> samplers.Posterior:
    """The posterior after a record of some sampling rate."""
    return samplers.Posterior(
        closed_form=lambda: _estimate(rate).friction,
        ours=partial(_ours, rate),
        pymc_model=partial(_pymc_model, rate),
        numpyro_model=partial(_numpyro_model, rate),
        parameters=partial(_parameters, rate),
    )


def prepared(name: str) -> Callable[[], samplers.Draws]:
    """The first run of a sampler, that of a peer with its coordinates ready."""
    if name != OURS:
        density()
    return partial(samplers.SAMPLERS[name], posterior(), 0)


def compare() -> list[str]:
    """The table of the page, and the two fastest once more on a long record."""
    lines = samplers.compared(posterior(), "whole_signal")
    few, many = (density(rate).observed.size for rate in (RATE, FAST))
    ours, peer = (samplers.pace(posterior(FAST), name) for name in (OURS, "nutpie"))
    return [
        *lines,
        "",
        f"{few} samples. Of {many}, at {FAST:g} Hz, one warm run each: "
        f"emcee {ours:.0f} effective draws a second, nutpie {bold(f'{peer:.0f}', peer > ours)}.",
    ]
