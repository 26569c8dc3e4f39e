"""Whatever the candidates, their report is of one posterior."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from friction_bayes.core.summary import Summary
from friction_bayes.loop.infer.law_draws import DRAWS, shared_out
from friction_bayes.loop.mixture.mixture import CandidateMixture, ranked
from friction_bayes.loop.mixture.slight_effects import SlightForce

NAMES = ("viscous_damping", "quadratic_drag", "friction_drift", "sensor_offset")


def made(sets: list[frozenset[str]], log_weights: list[float], level: float, seed: int) -> CandidateMixture:
    """Candidates whose friction is a number of their own, with a spread."""
    weight = np.exp(np.array(log_weights) - max(log_weights))
    names, probabilities = ranked(dict(zip(sets, weight, strict=True)))
    levels, rng = level + np.arange(len(names)), np.random.default_rng(seed)
    chosen = rng.choice(len(names), size=DRAWS, p=probabilities)
    force = np.array([float("random_force" in each) for each in names])[chosen]
    return CandidateMixture(
        sets=names,
        probabilities=probabilities,
        candidate=chosen,
        friction=np.exp(levels[chosen] * rng.standard_normal(DRAWS)),
        random_force=force,
        scores=force[:, None],
    )


@settings(max_examples=60)
@given(
    plain=st.lists(st.floats(-60.0, 60.0), min_size=1, max_size=5),
    forced=st.lists(st.floats(-60.0, 60.0), min_size=0, max_size=5),
    level=st.floats(0.1, 3.0),
    seed=st.integers(0, 2**32 - 1),
)
def test_every_summary_is_of_one_posterior(
    plain: list[float], forced: list[float], level: float, seed: int
) -> None:
    sets = [frozenset(NAMES[:k]) for k in range(5)]
    with_force = [names | {"random_force"} for names in sets[: len(forced)]]
    drawn = mixture = made([*sets[: len(plain)], *with_force], [*plain, *forced], level, seed)
    assert abs(mixture.probabilities.sum() - 1.0) < 1e-9
    assert np.all(np.diff(mixture.probabilities) <= 0.0)
    assert len(set(mixture.sets)) == len(mixture.sets)
    assert frozenset() in mixture.sets
    assert drawn.candidate.size == DRAWS
    # five standard errors of a share, of draws of draws
    for i, p in enumerate(mixture.probabilities):
        share = np.mean(drawn.candidate == i)
        assert abs(share - p) < 5.0 * np.sqrt(2.0 * p * (1.0 - p) / DRAWS) + 5.0 / DRAWS
    forced_share = np.mean(drawn.random_force > 0.0)
    p = mixture.probability("random_force")
    assert abs(forced_share - p) < 5.0 * np.sqrt(2.0 * p * (1.0 - p) / DRAWS) + 5.0 / DRAWS
    summary = Summary.of_draws(drawn.friction, "N")
    assert summary.interval90[0] <= summary.mean <= summary.interval90[1]


def test_a_slight_force_moves_draws_without_one_alone(seed: int) -> None:
    plain = made([frozenset(), frozenset({"random_force"})], [0.0, 0.0], 0.1, seed)
    slight = SlightForce(probability=1.0, shift=5.0, sd=0.0)
    drawn = plain.with_slight_force(slight, np.random.default_rng(seed))
    still = drawn.random_force == 0.0
    np.testing.assert_allclose(drawn.friction[still], plain.friction[still] + 5.0)
    np.testing.assert_array_equal(drawn.friction[~still], plain.friction[~still])


@settings(max_examples=60)
@given(
    weight=st.lists(st.floats(0.0, 1e6), min_size=1, max_size=50).filter(lambda some: sum(some) > 1e-6),
    draws=st.integers(1, 5000),
    seed=st.integers(0, 2**32 - 1),
)
def test_each_part_has_its_share_of_the_draws_within_one(weight: list[float], draws: int, seed: int) -> None:
    counts = shared_out(draws, np.array(weight), np.random.default_rng(seed))
    share = draws * np.array(weight) / sum(weight)
    assert counts.sum() == draws
    assert np.all(np.abs(counts - share) < 1.0 + 1e-6)
    assert np.all(counts >= 0)


def test_the_shares_are_right_on_the_average(seed: int) -> None:
    rng, weight = np.random.default_rng(seed), np.array([0.5, 0.3, 0.15, 0.0499, 1e-4])
    counts = np.mean([shared_out(100, weight, rng) for _ in range(4000)], axis=0)
    # five standard errors of a number that is one or the other of two neighbours
    assert np.all(np.abs(counts - 100.0 * weight) < 5.0 * 0.5 / np.sqrt(4000.0))
