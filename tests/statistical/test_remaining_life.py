"""The remaining life on synthetic wear: uniform over seeded machines, held where wear kinks, and planted bugs
are found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy import stats

from curtailed import at_least
from friction_bayes import testing
from friction_bayes.core.arrays import Array
from friction_bayes.monitor import laws
from friction_bayes.monitor.remaining_life import remaining_life
from friction_bayes.monitor.wear import WearPosterior, WearPrior, fit_wear

RARE = 1e-4
"""False-alarm rate of what must hold: the suite is also run over many seeds."""
MACHINES = 200
FEW = 120
"""Enough to find a planted bug."""
TIMES = np.array([0.0, 1.0, 2.5, 3.0, 4.5, 6.0])
SD = np.array([0.02, 0.05, 0.01, 0.03, 0.02, 0.04])
THRESHOLD = 2.0
# friction about 1, doubling in some 12 units of time, at times falling
PRIOR = WearPrior(wander=0.15, scatter=0.03, drift_mean=0.08, drift_sd=0.1, level_mean=1.0, level_sd=0.3)


@dataclass(frozen=True)
class Machines:
    """Truths: wander, drift, estimates at the points, true remaining life (infinite: never)."""

    estimates: Array
    life: Array


def simulate(parameters: tuple[Array, ...], rng: np.random.Generator) -> Machines:
    """Wear path, its estimates, and the first passage after Tn, drawn from its own law (Wald)."""
    wander, scatter, drift, level = parameters
    n = wander.size
    steps = np.diff(TIMES)
    path = np.empty((n, TIMES.size))
    path[:, 0] = level
    moved = drift[:, None] * steps + wander[:, None] * np.sqrt(steps) * rng.standard_normal((n, steps.size))
    path[:, 1:] = level[:, None] + np.cumsum(moved, axis=1)
    noise = np.hypot(SD, scatter[:, None]) * rng.standard_normal(path.shape)
    distance = THRESHOLD - path[:, -1]
    above = distance <= 0.0
    # against the drift it still crosses with this probability, and as fast as with it
    against = np.exp(np.minimum(2.0 * drift * distance / wander**2, 0.0))
    crosses = above | (drift > 0.0) | (rng.random(n) < against)
    d = np.where(above, 1.0, distance)
    first = rng.wald(d / np.abs(drift), (d / wander) ** 2)
    return Machines(path + noise, np.where(above, 0.0, np.where(crosses, first, np.inf)))


def draw_prior(rng: np.random.Generator, n: int) -> tuple[Array, ...]:
    wander, scatter = (scale * np.abs(rng.standard_cauchy(n)) for scale in (PRIOR.wander, PRIOR.scatter))
    return (
        *(wander, scatter),
        rng.normal(PRIOR.drift_mean, PRIOR.drift_sd, n),
        rng.normal(PRIOR.level_mean, PRIOR.level_sd, n),
    )


def pit(change: Callable[[WearPosterior], WearPosterior], seed: int) -> Callable[..., Array]:
    """Distribution function at the truth; spread over its atoms, zero and never, to be uniform."""

    def posterior_cdf(data: Machines, _: tuple[Array, ...]) -> Array:
        within = np.random.default_rng(seed).random(data.life.size)
        result = np.empty(data.life.size)
        for k, (estimates, life) in enumerate(zip(data.estimates, data.life, strict=True)):
            wear = change(fit_wear(TIMES, estimates, SD, PRIOR))
            found = remaining_life(wear, THRESHOLD, TIMES[-1])
            if life == 0.0:
                result[k] = within[k] * found.already
            elif np.isinf(life):
                result[k] = 1.0 - within[k] * found.never
            else:
                result[k] = found.cdf(life)
        return np.clip(result, 0.0, 1.0)

    return posterior_cdf


def test_is_calibrated(seed: int) -> None:
    testing.assert_calibrated(
        draw_prior,
        simulate,
        pit(lambda wear: wear, seed),
        replications=MACHINES,
        seed=seed,
        false_alarm_rate=RARE,
    )


BUGS: dict[str, Callable[[WearPosterior], WearPosterior]] = {
    "the mean path alone": lambda wear: replace(
        wear,
        wander=1e-2 * wear.wander,
        drift_variance=1e-4 * wear.drift_variance,
        covariance=1e-4 * wear.covariance,
    ),
    "friction at Tn too high": lambda wear: replace(wear, level=wear.level + 0.35),
}


@pytest.mark.parametrize("bug", BUGS)
def test_planted_bug_is_found(bug: str, seed: int) -> None:
    with pytest.raises(AssertionError, match="not calibrated"):
        testing.assert_calibrated(draw_prior, simulate, pit(BUGS[bug], seed), replications=FEW, seed=seed)


KINKED = 12
FASTER = 4.5


def held_where_wear_kinks(rng: np.random.Generator) -> Iterator[bool]:
    """Of machines whose rate of wear rises at once, whether the 90 % interval covers the remaining life."""
    for _ in range(KINKED):
        times = np.sort(np.append(rng.uniform(0.0, 10.0, 22), [0.0, 10.0]))
        when, rate = rng.uniform(4.0, 8.0), 0.02
        friction = 1.0 + rate * times + (FASTER - 1.0) * rate * np.maximum(times - when, 0.0)
        estimates = friction + 0.005 * rng.standard_normal(times.size)
        life = rng.uniform(2.0, 15.0)
        found = laws.fit_laws(times, estimates, np.full(times.size, 0.005)).remaining_life(
            friction[-1] + FASTER * rate * life
        )
        yield bool(found.ppf(0.05) <= life <= found.ppf(0.95))


def least_held() -> int:
    """Fewer hold with the false-alarm rate, where as many should as the interval says."""
    return int(stats.binom.ppf(RARE, KINKED, 0.9))


def test_wear_that_kinks_is_held(rng: np.random.Generator) -> None:
    assert at_least(least_held(), held_where_wear_kinks(rng))


def test_wear_that_kinks_is_missed_without_its_law(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(laws, "_STEEPEST_KINK", 1.0 + 1e-9)
    assert at_least(KINKED + 1 - least_held(), (not held for held in held_where_wear_kinks(rng)))
