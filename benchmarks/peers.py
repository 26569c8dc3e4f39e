"""The reference sampler and the closed form next to other samplers, on one posterior in one run.

``python -m benchmarks.peers [--page PAGE]`` prints a table; ``--page`` puts it between the markers of a
Markdown page. The extra ``peers`` brings the other samplers. Times are processor times, all chains in one
process. Cold is the first draw of a fresh process with empty caches, imports and compilation included.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np

from benchmarks.accuracy import written_between
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.arrays import Array

CHAINS, TUNING, DRAWS = 4, 1000, 2000
ROUNDS = 5
PRIOR = NormalGamma(mu=0.0, lam=0.01, alpha=2.0, beta=0.01)
SAMPLES = 0.07 + 0.01 * np.random.default_rng(1).standard_normal(100)
"""Friction samples of the paper's size [N]."""

Draws = tuple[Array, Array]
"""Friction and precision, each of shape (chains, draws)."""


def emcee_ours(seed: int) -> Draws:
    """The package's own reference, until it counts 5,000 effective draws."""
    from friction_bayes.conjugate.targets import normal_gamma_target
    from friction_bayes.reference.sampling import sample_target

    posterior = sample_target(normal_gamma_target(PRIOR, SAMPLES), seed=seed, ess=5000.0)["posterior"]
    return posterior["friction"].values, posterior["precision"].values


def _pymc_model():
    import pymc

    with pymc.Model() as model:
        precision = pymc.Gamma("precision", alpha=PRIOR.alpha, beta=PRIOR.beta)
        friction = pymc.Normal("friction", mu=PRIOR.mu, tau=PRIOR.lam * precision)
        pymc.Normal("samples", mu=friction, tau=precision, observed=SAMPLES)
    return model


def pymc_nuts(seed: int) -> Draws:
    """NUTS of PyMC; each run compiles its model, as a user's does."""
    import pymc

    with _pymc_model():
        posterior = pymc.sample(
            DRAWS, tune=TUNING, chains=CHAINS, cores=1, random_seed=seed, progressbar=False,
            compute_convergence_checks=False, nuts_sampler="pymc",
        )["posterior"]  # fmt: skip
    return posterior["friction"].values, posterior["precision"].values


_kept: dict[str, object] = {}
"""Models that their library compiles once for any number of runs."""


def nutpie_nuts(seed: int) -> Draws:
    """NUTS of nutpie, compiled once."""
    import nutpie

    if "nutpie" not in _kept:
        _kept["nutpie"] = nutpie.compile_pymc_model(_pymc_model())
    posterior = nutpie.sample(
        _kept["nutpie"], draws=DRAWS, tune=TUNING, chains=CHAINS, cores=1, seed=seed, progress_bar=False
    )["posterior"]
    return posterior["friction"].values, posterior["precision"].values


def numpyro_nuts(seed: int) -> Draws:
    """NUTS of NumPyro in double precision, compiled once, its chains side by side in one program."""
    import jax
    import numpyro
    from numpyro import distributions

    if "numpyro" not in _kept:
        numpyro.enable_x64()

        def model() -> None:
            precision = numpyro.sample("precision", distributions.Gamma(PRIOR.alpha, PRIOR.beta))
            friction = numpyro.sample(
                "friction", distributions.Normal(PRIOR.mu, (PRIOR.lam * precision) ** -0.5)
            )
            numpyro.sample("samples", distributions.Normal(friction, precision**-0.5), obs=SAMPLES)

        _kept["numpyro"] = numpyro.infer.MCMC(
            numpyro.infer.NUTS(model),
            num_warmup=TUNING,
            num_samples=DRAWS,
            num_chains=CHAINS,
            chain_method="vectorized",
            progress_bar=False,
            jit_model_args=True,
        )
    mcmc = _kept["numpyro"]
    mcmc.run(jax.random.PRNGKey(seed))
    draws = mcmc.get_samples(group_by_chain=True)
    return np.asarray(draws["friction"]), np.asarray(draws["precision"])


SAMPLERS: dict[str, Callable[[int], Draws]] = {
    "emcee": emcee_ours,
    "pymc": pymc_nuts,
    "nutpie": nutpie_nuts,
    "numpyro": numpyro_nuts,
}
PACKAGES = ("emcee", "pymc", "nutpie", "numpyro", "jax", "pytensor", "numpy")


def effective(draws: Draws) -> float:
    """Least bulk effective sample size of friction and precision, by one rule for all."""
    from arviz_stats.base import array_stats

    return min(float(array_stats.ess(each, chain_axis=0, draw_axis=1, method="bulk")) for each in draws)


def cold(name: str) -> tuple[float, float]:
    """Processor time and effective draws of the first run in a fresh process with empty caches."""
    with tempfile.TemporaryDirectory() as empty:
        environment = {**os.environ, "NUMBA_CACHE_DIR": empty, "PYTENSOR_FLAGS": f"base_compiledir={empty}"}
        before = os.times()
        ran = subprocess.run(
            [sys.executable, "-W", "ignore", "-m", "benchmarks.peers", "--first", name],
            env=environment, check=True, capture_output=True, text=True,
        )  # fmt: skip
        after = os.times()
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    return spent, json.loads(ran.stdout.splitlines()[-1])


def timed(work: Callable[[], Draws]) -> tuple[float, Draws]:
    """Processor time of a work, and what it gave."""
    started = process_time()
    draws = work()
    return process_time() - started, draws


def table() -> list[str]:
    """One row a sampler; what beats the package's own reference is in bold."""
    first = {name: cold(name) for name in SAMPLERS}
    rates: dict[str, list[float]] = {name: [] for name in SAMPLERS}
    means: dict[str, list[float]] = {name: [] for name in SAMPLERS}
    for sampler in SAMPLERS.values():
        sampler(0)
    for seed in range(1, ROUNDS + 1):
        for name, sampler in SAMPLERS.items():
            spent, draws = timed(partial(sampler, seed))
            rates[name].append(effective(draws) / spent)
            means[name].append(float(np.mean(draws[0])))
    exact = PRIOR.update(SAMPLES).friction
    started = process_time()
    for _ in range(1000):
        PRIOR.update(SAMPLES).friction.interval(0.9)
    closed = (process_time() - started) / 1000
    lines = [
        "`python -m benchmarks.peers`; " + ", ".join(f"{name} {version(name)}" for name in PACKAGES) + ".",
        "",
        "| sampler | effective draws a second, cold | warm | warm, over ours | mean less exact [sd] |",
        "|---|---|---|---|---|",
    ]
    ours = first["emcee"][1] / first["emcee"][0]
    for name in SAMPLERS:
        spent, count = first[name]
        over = median(a / b for a, b in zip(rates[name], rates["emcee"], strict=True))
        mark = ["**" if better else "" for better in (count / spent > ours, over > 1.0)]
        off = (float(np.mean(means[name])) - exact.mean()) / exact.std()
        lines.append(
            f"| {name} | {mark[0]}{count / spent:.0f}{mark[0]} | {mark[1]}{median(rates[name]):.0f}{mark[1]} "
            f"| {mark[1]}{over:.2f}{mark[1]} | {off:+.3f} |"
        )
    needed = 5000.0 / median(rates["emcee"])
    lines += [
        "",
        f"The closed form with its 90 % interval takes {1e6 * closed:.0f} us; 5,000 effective draws of "
        f"emcee, warm, {needed / closed:.0f} times that.",
    ]
    return lines


def main() -> None:
    """Measure, and print or write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description=__doc__)
    parser.add_argument("--first", choices=SAMPLERS, help="run one sampler and print its effective draws")
    parser.add_argument("--page", type=Path, help="Markdown page to put the table into")
    options = parser.parse_args()
    if options.first is not None:
        print(effective(SAMPLERS[options.first](0)))
        return
    lines = table()
    print("\n".join(lines))
    if options.page is not None:
        written_between(options.page, "peers", lines)


if __name__ == "__main__":
    main()
