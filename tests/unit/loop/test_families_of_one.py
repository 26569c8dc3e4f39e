"""How far the search of one record goes where a random force is weighed beside it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.special import logsumexp

from decays import SYSTEM, fluctuating_friction, slow_decay
from friction_bayes.loop.data.prepared_record import Segment, cut_records
from friction_bayes.loop.mixture.families import families_of_one
from friction_bayes.loop.mixture.force_family import ForceFamily, log_share_of_search
from friction_bayes.loop.mixture.search_family import SearchFamily
from friction_bayes.loop.search.run_search import search_records

TRIED = ("viscous_damping", "quadratic_drag", "friction_drift", "cubic_stiffness", "sensor_offset")
ALLOWED = (*TRIED[:4], "random_force", TRIED[4])
MOST_SPARED = 3


def record_of(share: float, noise_sd: float = 1e-5, **effects: float) -> Segment:
    forces = fluctuating_friction(share) if share else {}
    damped = {"viscous_damping.damping_ratio": 0.004}
    record = slow_decay(
        duration=10.0, sampling_rate=50.0, noise_sd=noise_sd, seed=3, effects=forces | damped | effects
    )
    (segment,) = cut_records([record], SYSTEM)
    return segment


def weighed(segment: Segment, progress: Any = None) -> tuple[SearchFamily, ForceFamily | None]:
    rngs = np.random.default_rng(1).spawn(2)
    return families_of_one(SYSTEM, segment, ALLOWED, TRIED, 0.2, rngs, progress)


@pytest.fixture(scope="module")
def forced() -> tuple[SearchFamily, ForceFamily]:
    search, force = weighed(record_of(0.3))
    assert force is not None
    return search, force


def test_where_only_a_random_force_explains_the_search_fits_the_law_found_alone(
    forced: tuple[SearchFamily, ForceFamily],
) -> None:
    search, force = forced
    assert len(search.sets) <= MOST_SPARED
    assert force.sets[0] - {"random_force"} in search.sets
    assert search.trail[-1].startswith("no sets looked for besides viscous_damping")


def test_what_is_spared_would_not_be_weighed(forced: tuple[SearchFamily, ForceFamily]) -> None:
    """The whole search of the same record stays out of reach, and the candidates are the same."""
    _, force = forced
    segment = record_of(0.3)
    found = search_records(SYSTEM, (segment,), TRIED, "auto", None)
    whole = SearchFamily(found, ALLOWED, np.random.default_rng(1))
    beside = ForceFamily(whole, force.fit, ALLOWED, 0.2, np.random.default_rng(2))
    assert len(whole.sets) > MOST_SPARED
    assert logsumexp(beside.log_weights) - logsumexp(whole.log_weights) > 20.0
    assert beside.sets[:4] == force.sets[:4]
    np.testing.assert_allclose(
        np.diff(beside.log_weights[:4]), np.diff(force.log_weights[:4]), rtol=0, atol=1e-6
    )


def test_noise_of_the_sensor_alone_is_searched_whole() -> None:
    search, force = weighed(record_of(0.0))
    assert force is not None
    assert log_share_of_search(force.fit, TRIED) > -1.0
    assert len(search.sets) > MOST_SPARED


def test_a_record_without_noise_is_searched_whole_and_alone() -> None:
    search, force = weighed(record_of(0.0, noise_sd=0.0))
    assert force is None
    assert len(search.sets) > MOST_SPARED


def test_a_force_of_several_frictions_spares_the_search_too() -> None:
    search, force = weighed(record_of(4.0))
    assert force is not None
    assert force.lead > 50.0
    assert len(search.sets) <= MOST_SPARED


def test_an_unexplained_record_is_read_with_all_that_the_search_finds(
    forced: tuple[SearchFamily, ForceFamily],
) -> None:
    search, _ = forced
    found = search_records(SYSTEM, (record_of(0.3),), TRIED, "auto", None)
    whole = SearchFamily(found, ALLOWED, np.random.default_rng(5))
    # both are mixtures over the same candidates: their draws agree within what their number allows
    error = 5.0 * whole.draws.friction.std() * np.sqrt(2.0 / whole.draws.friction.size)
    assert abs(search.reading.friction.mean() - whole.draws.friction.mean()) < error
