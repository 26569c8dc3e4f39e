"""A parameter that shapes a term shares its effect's probability out as its prior does."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import halfnorm

from friction_bayes.loop.columns.effect_columns import LawColumn
from friction_bayes.loop.infer.record_fit import ForceFit
from unsteady_decays import RELEASE, bent_record, fitted


@pytest.mark.parametrize("name", ["stribeck_friction", "presliding"])
def test_shares_of_the_prior_follow_it(rng: np.random.Generator, name: str) -> None:
    fit = fitted(bent_record(rng, 0.0), ("viscous_damping", name))
    alone = [j for j, names in enumerate(fit.sets) if names == {name}]
    share = np.exp(fit.regression.log_prior[alone])
    share /= share.sum()
    shapes = [next(c.shape[0] for c in _of(fit, name, j)) for j in alone]
    ends = np.array([[shape.low, shape.high] for shape in shapes])
    np.testing.assert_allclose(ends[1:, 0], ends[:-1, 1], rtol=1e-9)
    if name == "presliding":
        mass = np.diff(halfnorm.cdf(ends, scale=RELEASE / 50.0), axis=1)[:, 0]
        # a part is represented by its middle, on the scale of normal scores
        np.testing.assert_allclose(share, mass / mass.sum(), rtol=0.1, atol=0.003)
    assert np.argmax(share) == len(share) // 2


def _of(fit: ForceFit, name: str, row: int) -> list[LawColumn]:
    held = np.flatnonzero(fit.regression.sets[row])
    return [fit.law.columns[j] for j in held if fit.law.columns[j].effect == name]
