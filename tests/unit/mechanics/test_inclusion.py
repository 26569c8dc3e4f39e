"""The prior of the set of effects that act."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import comb, expit, logsumexp

from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.inclusion import inclusion, log_probability, prior_log_odds


@pytest.mark.parametrize("considered", [1, 7, 23, 60])
def test_all_sets_together_are_certain(considered: int) -> None:
    acting = np.arange(considered + 1)
    total = comb(considered, acting) @ np.exp(log_probability(acting, considered))
    assert total == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(("acting", "considered"), [(0, 0), (0, 5), (2, 5), (3, 22)])
def test_an_effect_that_is_not_considered_changes_nothing(acting: int, considered: int) -> None:
    """Its part is the sum over whether it acts."""
    both = log_probability(np.array([acting, acting + 1]), considered + 1)
    assert float(logsumexp(both)) == pytest.approx(float(log_probability(acting, considered)), abs=1e-12)


def test_none_is_as_probable_as_some_however_long_the_catalogue_is(monkeypatch: pytest.MonkeyPatch) -> None:
    for size in (3, 24, 300):
        catalogue = dict.fromkeys(range(size))
        monkeypatch.setattr("friction_bayes.mechanics.effects.inclusion.EFFECTS", catalogue)
        assert float(log_probability(0, size)) == pytest.approx(math.log(0.5))


def test_one_effect_by_itself() -> None:
    assert float(log_probability(1, 1)) == pytest.approx(math.log(inclusion()))
    assert expit(prior_log_odds()) == pytest.approx(inclusion())
    assert inclusion() == pytest.approx(1.0 / (1 + len(EFFECTS)))
