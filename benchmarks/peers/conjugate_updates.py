"""The paper's two conjugate pairs after 100 friction samples: update and 90 % interval in closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from statistics import median
from typing import Any

import numpy as np

from benchmarks.peers.friction_samples import PRIOR, SAMPLES
from benchmarks.peers.measuring import bold, over, table, timed
from friction_bayes.conjugate.gamma_exponential import GammaExponential
from friction_bayes.core.arrays import Array

PACKAGES = ("conjugate-models", "scipy", "numpy")
RATE_PRIOR = GammaExponential(alpha=1.0, kappa=0.02)
NORMAL, EXPONENTIAL = "normal-gamma", "gamma-exponential"
LOADS = (0.0, 1000.0)
"""Added to every sample: under the second, squares are much larger than their differences [N]."""
ROUNDS = 500
OURS, PEER = "ours", "conjugate-models"


@dataclass(frozen=True)
class Pair:
    """A pair as a package has it.

    Attributes
    ----------
    update : callable, samples -> posterior
    interval : callable, posterior -> two float
        90 % interval.
    parameters : tuple of str
        What the posterior calls its parameters.
    """

    update: Callable[[Array], Any]
    interval: Callable[[Any], tuple[float, float]]
    parameters: tuple[str, ...]


def _normal(samples: Array) -> Any:
    from conjugate import distributions, models

    prior = distributions.NormalGamma(mu=PRIOR.mu, lam=PRIOR.lam, alpha=PRIOR.alpha, beta=PRIOR.beta)
    return models.normal(x_total=samples.sum(), x2_total=(samples**2).sum(), n=samples.size, prior=prior)


def _normal_interval(after: Any) -> tuple[float, float]:
    from conjugate.distributions import StudentT

    scale = (after.beta / after.alpha / after.lam) ** 0.5
    low, high = StudentT(mu=after.mu, sigma=scale, nu=2.0 * after.alpha).dist.interval(0.9)
    return float(low), float(high)


def _exponential(samples: Array) -> Any:
    from conjugate import distributions, models

    prior = distributions.Gamma(alpha=RATE_PRIOR.alpha, beta=RATE_PRIOR.kappa)
    return models.exponential_gamma(x_total=samples.sum(), n=samples.size, prior=prior)


def _ours_interval(after: Any) -> tuple[float, float]:
    low, high = after.friction_interval(0.9)
    return low, high


_FOUR = ("mu", "lam", "alpha", "beta")
PAIRS: dict[str, dict[str, Pair]] = {
    NORMAL: {
        OURS: Pair(PRIOR.update, _ours_interval, _FOUR),
        PEER: Pair(_normal, _normal_interval, _FOUR),
    },
    EXPONENTIAL: {
        OURS: Pair(RATE_PRIOR.update, _ours_interval, ("alpha", "kappa")),
        PEER: Pair(_exponential, lambda after: after.dist.interval(0.9), ("alpha", "beta")),
    },
}


def exact(name: str, samples: Array) -> tuple[float, ...]:
    """Parameters of the posterior in rational arithmetic, rounded once."""
    x, n = [Fraction(each) for each in samples.tolist()], samples.size
    if name == EXPONENTIAL:
        return RATE_PRIOR.alpha + n, float(Fraction(RATE_PRIOR.kappa) + sum(x))
    mu, lam, alpha, beta = (Fraction(getattr(PRIOR, each)) for each in _FOUR)
    after = (lam * mu + sum(x)) / (lam + n)
    squares = sum(each**2 for each in x) + lam * mu**2 - (lam + n) * after**2
    return tuple(float(each) for each in (after, lam + n, alpha + Fraction(n, 2), beta + squares / 2))


def error(name: str, package: str, samples: Array) -> float:
    """Largest relative error of the posterior's parameters."""
    pair = PAIRS[name][package]
    after = pair.update(samples)
    found = [getattr(after, each) for each in pair.parameters]
    return float(np.max(np.abs(np.divide(found, exact(name, samples)) - 1.0)))


def _times(pairs: dict[str, Pair], work: Callable[[Pair], Any]) -> dict[str, tuple[str, str]]:
    """Median processor time in microseconds and over ours, of runs in turn."""
    times: dict[str, list[float]] = {package: [] for package in pairs}
    for _ in range(ROUNDS):
        for package, pair in pairs.items():
            times[package].append(timed(lambda pair=pair: work(pair))[0])
    shown = {}
    for package, each in times.items():
        ratio = over(each, times[OURS])
        texts = f"{1e6 * median(each):.0f}", f"{ratio:.2f}"
        shown[package] = (bold(texts[0], ratio < 1.0), bold(texts[1], ratio < 1.0))
    return shown


def compare() -> list[str]:
    """The table of the page."""
    rows = []
    for name, pairs in PAIRS.items():
        updates = _times(pairs, lambda pair: pair.update(SAMPLES))
        intervals = _times(pairs, lambda pair: pair.interval(pair.update(SAMPLES)))
        errors = {package: [error(name, package, SAMPLES + load) for load in LOADS] for package in pairs}
        for package in pairs:
            both = zip(errors[package], errors[OURS], strict=True)
            shown = [bold(f"{each:.0e}", each < own) for each, own in both]
            rows.append([name, package, *updates[package], *intervals[package], *shown])
    headings = ["pair", "package", "update [us]", "over ours", "and interval [us]", "over ours"]
    return table([*headings, "relative error", f"with {LOADS[1]:g} N added"], rows)
