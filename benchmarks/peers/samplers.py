"""Samplers on one posterior, each as its user runs it: effective draws a second of processor time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from statistics import median
from typing import Any

import numpy as np
import xarray as xr

from benchmarks.peers.measuring import bold, cold, over, table, timed
from friction_bayes.core.arrays import Array

__all__ = ["ESS", "OURS", "PACKAGES", "SAMPLERS", "Draws", "Posterior", "compared", "effective", "pace"]

CHAINS, TUNING, DRAWS = 4, 1000, 2000
ROUNDS = 3
OURS = "emcee"
ESS = 5000.0
"""Effective draws, by the package's own count, until which its reference goes on."""
PACKAGES = ("emcee", "pymc", "nutpie", "numpyro", "jax", "pytensor", "numpy")

Draws = Mapping[str, Array]
"""Draws of each parameter, friction among them, shape (chains, draws)."""


@dataclass(frozen=True)
class Posterior:
    """One posterior, written for every sampler.

    Attributes
    ----------
    closed_form : callable, () -> distribution
        Friction in closed form, from the data.
    ours : callable, seed -> DataTree
        Draws of the package's own reference, from the data.
    pymc_model, numpyro_model : callable
        The same density; the second as NumPyro wants it, a function that samples.
    parameters : callable
        From what their draws are called to the parameters that the reference samples.
    """

    closed_form: Callable[[], Any]
    ours: Callable[[int], xr.DataTree]
    pymc_model: Callable[[], Any]
    numpyro_model: Callable[[], None]
    parameters: Callable[[Draws], Draws]


def _ours(posterior: Posterior, seed: int) -> Draws:
    """The package's own reference, until it counts enough effective draws."""
    draws = posterior.ours(seed)["posterior"].dataset
    return {str(name): each.values for name, each in draws.items() if each.dims == ("chain", "draw")}


def _named(posterior: Posterior, found: Any) -> Draws:
    return posterior.parameters({name: np.asarray(each) for name, each in found.items()})


def _pymc(posterior: Posterior, seed: int) -> Draws:
    """NUTS of PyMC; each run compiles its model, as a user's does."""
    import pymc

    with posterior.pymc_model():
        found = pymc.sample(
            DRAWS, tune=TUNING, chains=CHAINS, cores=1, random_seed=seed, progressbar=False,
            compute_convergence_checks=False, nuts_sampler="pymc",
        )["posterior"]  # fmt: skip
    return _named(posterior, found)


_kept: dict[tuple[str, Posterior], Any] = {}
"""Models that their library compiles once for any number of runs."""


def _nutpie(posterior: Posterior, seed: int) -> Draws:
    """NUTS of nutpie, compiled once."""
    import nutpie

    if ("nutpie", posterior) not in _kept:
        _kept["nutpie", posterior] = nutpie.compile_pymc_model(posterior.pymc_model())
    model = _kept["nutpie", posterior]
    found = nutpie.sample(
        model, draws=DRAWS, tune=TUNING, chains=CHAINS, cores=1, seed=seed, progress_bar=False
    )
    return _named(posterior, found["posterior"])


def _numpyro(posterior: Posterior, seed: int) -> Draws:
    """NUTS of NumPyro in double precision, compiled once, its chains side by side in one program."""
    import jax
    import numpyro

    if ("numpyro", posterior) not in _kept:
        numpyro.enable_x64()
        _kept["numpyro", posterior] = numpyro.infer.MCMC(
            numpyro.infer.NUTS(posterior.numpyro_model),
            num_warmup=TUNING,
            num_samples=DRAWS,
            num_chains=CHAINS,
            chain_method="vectorized",
            progress_bar=False,
            jit_model_args=True,
        )
    mcmc = _kept["numpyro", posterior]
    mcmc.run(jax.random.PRNGKey(seed))
    return _named(posterior, mcmc.get_samples(group_by_chain=True))


SAMPLERS: dict[str, Callable[[Posterior, int], Draws]] = {
    OURS: _ours,
    "pymc": _pymc,
    "nutpie": _nutpie,
    "numpyro": _numpyro,
}


def effective(draws: Draws) -> float:
    """Least bulk effective sample size of the parameters, by one rule for all."""
    from arviz_stats.base import array_stats

    return min(
        float(array_stats.ess(each, chain_axis=0, draw_axis=1, method="bulk")) for each in draws.values()
    )


def pace(posterior: Posterior, name: str) -> float:
    """Effective draws a second of one warm run of a sampler."""
    SAMPLERS[name](posterior, 0)
    spent, draws = timed(partial(SAMPLERS[name], posterior, 1))
    return effective(draws) / spent


def compared(posterior: Posterior, section: str) -> list[str]:
    """One row a sampler; what beats the package's own reference is in bold."""
    first = {name: cold(section, name) for name in SAMPLERS}
    paces: dict[str, list[float]] = {name: [] for name in SAMPLERS}
    frictions: dict[str, list[Array]] = {name: [] for name in SAMPLERS}
    for sampler in SAMPLERS.values():
        sampler(posterior, 0)
    for seed in range(1, ROUNDS + 1):
        for name, sampler in SAMPLERS.items():
            spent, draws = timed(partial(sampler, posterior, seed))
            paces[name].append(effective(draws) / spent)
            frictions[name].append(draws["friction"])
    exact = posterior.closed_form()
    closed = median(timed(lambda: posterior.closed_form().interval(0.9))[0] for _ in range(200))
    rates = {name: count / spent for name, (spent, count) in first.items()}
    rows = []
    for name in SAMPLERS:
        ratio = over(paces[name], paces[OURS])
        drawn = np.concatenate([each.ravel() for each in frictions[name]])
        rows.append(
            [
                name,
                bold(f"{rates[name]:.0f}", rates[name] > rates[OURS]),
                bold(f"{median(paces[name]):.0f}", ratio > 1.0),
                bold(f"{ratio:.2f}", ratio > 1.0),
                f"{(drawn.mean() - exact.mean()) / exact.std():+.3f}",
                f"{drawn.std() / exact.std():.3f}",
            ]
        )
    needed = ESS / median(paces[OURS])
    headings = ["sampler", "effective draws a second, cold", "warm", "warm, over ours"]
    headings += ["mean less the closed form's [sd]", "sd over its sd"]
    return [
        *table(headings, rows),
        "",
        f"The closed form with its 90 % interval takes {1e3 * closed:.2g} ms; {ESS:,.0f} effective draws of "
        f"emcee, warm, {needed / closed:.0f} times that.",
    ]
