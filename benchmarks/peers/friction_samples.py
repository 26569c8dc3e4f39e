"""The posterior of the paper: Normal-Gamma, after 100 friction samples."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from benchmarks.peers import samplers
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.conjugate.targets import normal_gamma_target
from friction_bayes.reference.sampling import sample_target

OURS, PACKAGES, summary = samplers.OURS, samplers.PACKAGES, samplers.effective
PRIOR = NormalGamma(mu=0.0, lam=0.01, alpha=2.0, beta=0.01)
SAMPLES = 0.07 + 0.01 * np.random.default_rng(1).standard_normal(100)
"""Friction samples of the paper's size [N]."""


def _ours(seed: int) -> xr.DataTree:
    return sample_target(normal_gamma_target(PRIOR, SAMPLES), seed=seed, ess=samplers.ESS)


def _pymc_model() -> Any:
    import pymc

    with pymc.Model() as model:
        precision = pymc.Gamma("precision", alpha=PRIOR.alpha, beta=PRIOR.beta)
        friction = pymc.Normal("friction", mu=PRIOR.mu, tau=PRIOR.lam * precision)
        pymc.Normal("samples", mu=friction, tau=precision, observed=SAMPLES)
    return model


def _numpyro_model() -> None:
    import numpyro
    from numpyro import distributions

    precision = numpyro.sample("precision", distributions.Gamma(PRIOR.alpha, PRIOR.beta))
    friction = numpyro.sample("friction", distributions.Normal(PRIOR.mu, (PRIOR.lam * precision) ** -0.5))
    numpyro.sample("samples", distributions.Normal(friction, precision**-0.5), obs=SAMPLES)


POSTERIOR = samplers.Posterior(
    closed_form=lambda: PRIOR.update(SAMPLES).friction,
    ours=_ours,
    pymc_model=_pymc_model,
    numpyro_model=_numpyro_model,
    parameters=lambda draws: draws,
)


def prepared(name: str) -> Callable[[], samplers.Draws]:
    """The first run of a sampler."""
    return partial(samplers.SAMPLERS[name], POSTERIOR, 0)


def compare() -> list[str]:
    """The table of the page."""
    return samplers.compared(POSTERIOR, "friction_samples")
