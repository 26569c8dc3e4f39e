"""What holds for every conjugate update: order, batches, shift and scale do not matter."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from friction_bayes.conjugate.gamma_exponential import GammaExponential
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.conjugate.regression import NormalInverseGamma

VALUES = st.floats(-10.0, 10.0, width=32)
SAMPLES = arrays(float, st.integers(1, 30), elements=VALUES)
POSITIVE = arrays(float, st.integers(1, 30), elements=st.floats(0.0, 10.0, width=32))
OFFSETS = st.sampled_from([0.0, 1.0, 1e4, 1e8])
NORMAL_GAMMAS = st.builds(
    NormalGamma, VALUES, st.floats(1e-3, 10.0), st.floats(0.1, 10.0), st.floats(1e-2, 10.0)
)


def as_tuple(pair: NormalGamma) -> tuple[float, float, float, float]:
    return pair.mu, pair.lam, pair.alpha, pair.beta


def one_after_another(prior: Any, *data: Sequence[Any]) -> Any:
    """Each posterior is the prior of the next; ``data`` has a sequence for each argument of ``update``."""
    return reduce(lambda pair, arguments: pair.update(*arguments), zip(*data, strict=True), prior)


def moved(pair: NormalGamma, shift: float, scale: float) -> NormalGamma:
    return NormalGamma(scale * pair.mu + shift, pair.lam, pair.alpha, scale**2 * pair.beta)


@given(NORMAL_GAMMAS, SAMPLES, st.randoms(use_true_random=False))
def test_order_does_not_matter(prior: NormalGamma, samples: np.ndarray, random: object) -> None:
    shuffled = samples.tolist()
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    assert as_tuple(prior.update(shuffled)) == pytest.approx(
        as_tuple(prior.update(samples)), rel=1e-11, abs=1e-12
    )


@given(NORMAL_GAMMAS, SAMPLES, OFFSETS, st.floats(1e-3, 1e3))
def test_shift_and_scale(prior: NormalGamma, samples: np.ndarray, shift: float, scale: float) -> None:
    """Changing unit and zero before or after the update is the same."""
    before = moved(prior, shift, scale).update(scale * samples + shift)
    after = moved(prior.update(samples), shift, scale)
    # a sample at the shift is itself rounded by this much
    rounding = 4e-16 * shift
    assert before.mu == pytest.approx(after.mu, rel=1e-11, abs=4.0 * rounding + 1e-12 * scale)
    assert before.beta == pytest.approx(after.beta, rel=1e-10, abs=2000.0 * scale * rounding)
    assert (before.lam, before.alpha) == (after.lam, after.alpha)


@given(NORMAL_GAMMAS, SAMPLES, st.integers(0, 30), OFFSETS)
def test_batch_equals_sequential(prior: NormalGamma, samples: np.ndarray, cut: int, offset: float) -> None:
    data, start = samples + offset, moved(prior, offset, 1.0)
    batch = start.update(data)
    for last in (
        one_after_another(start, [data[:cut], data[cut:]]),
        one_after_another(start, list(data)),
    ):
        assert (last.lam, last.alpha) == pytest.approx((batch.lam, batch.alpha), rel=1e-13)
        assert last.mu == pytest.approx(batch.mu, rel=1e-14, abs=1e-12 + 1e-15 * offset)
        assert last.beta == pytest.approx(batch.beta, rel=1e-11 + 1e-15 * offset)


@given(NORMAL_GAMMAS, SAMPLES, st.integers(0, 30))
def test_evidence_multiplies(prior: NormalGamma, samples: np.ndarray, cut: int) -> None:
    first, second = samples[:cut], samples[cut:]
    apart = prior.log_evidence(first) + prior.update(first).log_evidence(second)
    assert prior.log_evidence(samples) == pytest.approx(apart, rel=1e-10, abs=1e-10)


@given(POSITIVE, st.integers(0, 30))
def test_gamma_exponential_batches(samples: np.ndarray, cut: int) -> None:
    prior = GammaExponential(0.5, 0.1)
    batch = prior.update(samples)
    last = one_after_another(prior, [samples[:cut], samples[cut:]])
    assert (last.alpha, last.kappa) == pytest.approx((batch.alpha, batch.kappa), rel=1e-13)
    assert prior.update(samples[::-1]).kappa == pytest.approx(batch.kappa, rel=1e-13)


@settings(max_examples=50)
@given(
    arrays(float, (12, 3), elements=VALUES),
    arrays(float, 12, elements=VALUES),
    st.integers(0, 12),
    st.permutations(range(12)),
)
def test_regression_batches_and_order(x: np.ndarray, y: np.ndarray, cut: int, order: list[int]) -> None:
    prior = NormalInverseGamma.from_prior(mean=np.zeros(3), precision=0.1, alpha=1.0, beta=1.0)
    batch = prior.update(x, y)
    split = one_after_another(prior, [x[:cut], x[cut:]], [y[:cut], y[cut:]])
    for other in (split, prior.update(x[order], y[order])):
        assert other.mean == pytest.approx(batch.mean, rel=1e-8, abs=1e-8)
        assert other.precision == pytest.approx(batch.precision, rel=1e-9, abs=1e-9)
        assert (other.alpha, other.beta) == pytest.approx((batch.alpha, batch.beta), rel=1e-9)
