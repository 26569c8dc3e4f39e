"""The protocol that every registered estimator follows, and one registered from outside."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest
from scipy import stats

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.conjugate.scaled_distribution import scaled
from friction_bayes.conjugate.targets import normal_gamma_target
from friction_bayes.decay.free_decay import FreeDecay, find_free_decay
from friction_bayes.decay.friction_samples import friction_samples
from friction_bayes.estimators.base import Fit, Fits, FreeDecays
from friction_bayes.estimators.priors import DeclaredSignal
from friction_bayes.estimators.registry import ESTIMATORS, estimator_named, register

FRICTION = 0.3
RECORD = short_decay(friction=FRICTION, duration=9.0, noise_sd=2e-4, seed=4)
DECAY = find_free_decay(RECORD, SYSTEM)
BATCH = FreeDecays(
    values=DECAY.values[None],
    located=DECAY.located,
    step=DECAY.step,
    system=SYSTEM,
    quantity=DECAY.quantity,
    unit=DECAY.unit,
)


def default_fit(method: str) -> Fit:
    estimator = estimator_named(method)
    return estimator.fit(DECAY, estimator.default_prior(DECAY), peaks="nominal")


@pytest.mark.parametrize("method", ESTIMATORS)
def test_default_prior_has_the_keys_that_may_be_set(method: str) -> None:
    estimator = estimator_named(method)
    assert estimator.name == method
    assert tuple(estimator.default_prior(DECAY)) == estimator.prior_keys
    assert estimator.default_prior(BATCH) == estimator.default_prior(DECAY)


@pytest.mark.parametrize("method", ESTIMATORS)
def test_closed_form_less_log_probability_is_one_constant(method: str, rng: np.random.Generator) -> None:
    target = default_fit(method).target
    points = (
        target.centre + rng.standard_normal((60, len(target.names))) @ np.linalg.cholesky(target.covariance).T
    )
    for place, name in enumerate(target.names):
        # a whole signal is linear, and its closed form exact, given these two
        if name in {"frequency", "phase"}:
            points[:, place] = target.centre[place]
    closed_form = target.closed_form(points)
    assert np.ptp(target.log_prob(points) - closed_form) < 1e-5
    assert np.ptp(closed_form) > 1.0


@pytest.mark.parametrize("method", ESTIMATORS)
def test_one_record_and_a_batch_of_one_agree(method: str) -> None:
    estimator = estimator_named(method)
    one = default_fit(method)
    many = estimator.fit_many(BATCH, estimator.default_prior(BATCH), peaks="nominal")
    assert many.found.tolist() == [True]
    coefficient = many.family(*(parameter[0] for parameter in many.parameters))
    quantiles = [0.05, 0.5, 0.95]
    np.testing.assert_allclose(coefficient.ppf(quantiles), one.coefficient.ppf(quantiles), rtol=1e-9)
    for name in ("frequency", "frequency_sd", "rest_position", "noise_sd"):
        np.testing.assert_allclose(getattr(many, name), [getattr(one, name)], rtol=1e-9, err_msg=name)


@pytest.mark.parametrize("method", ESTIMATORS)
def test_a_batch_may_hold_no_record(method: str) -> None:
    estimator = estimator_named(method)
    nothing = FreeDecays(
        values=np.empty((0, 900)),
        located=type(DECAY.located)(*(column[:0] for column in DECAY.located)),
        step=DECAY.step,
        system=SYSTEM,
        quantity=DECAY.quantity,
        unit=DECAY.unit,
    )
    many = estimator.fit_many(nothing, estimator.default_prior(nothing), peaks="highest")
    assert many.found.shape == (0,)


def test_a_fit_holds_no_target_which_could_not_be_pickled() -> None:
    for method in ESTIMATORS:
        fit = default_fit(method)
        assert fit.target.names
        assert "target" not in vars(fit)


class NominalPeaks:
    """Friction samples at nominal peaks, normal with a mean about ``guess``."""

    name = "nominal-peaks"
    prior_keys = ("guess",)

    def default_prior(self, signal: DeclaredSignal) -> dict[str, float]:
        return {"guess": 1e-4 * signal.system.stiffness}

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        samples = friction_samples(decay, "nominal")
        before = NormalGamma(mu=prior["guess"], lam=0.1, alpha=1.0, beta=1e-3)
        posterior = before.update(samples)
        return Fit(
            coefficient=scaled(posterior.friction, 1.0 / decay.system.stiffness),
            precision=posterior.precision,
            precision_unit="1/N^2",
            posterior=posterior,
            amplitudes=samples.size + 1,
            frequency=decay.frequency,
            frequency_sd=math.nan,
            rest_position=decay.rest_position,
            noise_sd=math.nan,
            prediction=None,
            build_target=lambda: normal_gamma_target(before, samples),
        )

    def fit_many(self, decays: FreeDecays, prior: Mapping[str, float], *, peaks: str) -> Fits:
        located = decays.located
        fits = [
            self.fit(
                FreeDecay(
                    name=str(k),
                    values=decays.values[k, located.start[k] : located.stop[k]],
                    start_time=0.0,
                    step=decays.step,
                    quantity=decays.quantity,
                    unit=decays.unit,
                    system=decays.system,
                    frequency=located.frequency[k] / decays.step,
                    phase=located.phase[k],
                    rest_position=located.rest_position[k],
                    stops=bool(located.stops[k]),
                ),
                prior,
                peaks=peaks,
            )
            for k in range(len(decays.values))
        ]
        keywords = [fit.coefficient.kwds for fit in fits]
        none = np.full(len(fits), np.nan)
        return Fits(
            family=stats.t,
            parameters=tuple(np.array([each[key] for each in keywords]) for key in ("df", "loc", "scale")),
            frequency=located.frequency / decays.step,
            frequency_sd=none,
            rest_position=located.rest_position,
            noise_sd=none,
        )


@pytest.fixture
def outsider(monkeypatch: pytest.MonkeyPatch) -> str:
    """An estimator registered from outside, for one test."""
    # registered through the front door; taken out again with the patch
    monkeypatch.setitem(ESTIMATORS, NominalPeaks.name, estimator_named("normal-gamma"))
    register(NominalPeaks())
    return NominalPeaks.name


def test_an_estimator_from_outside_is_one_of_them(outsider: str) -> None:
    one = fb.estimate(RECORD, SYSTEM, method=outsider, prior={"guess": 0.2})
    assert one.method == outsider
    assert one.prior == {"guess": 0.2}
    assert one.friction.mean() == pytest.approx(FRICTION, rel=0.1)
    assert one.to_dict()["friction"]["unit"] == "N"
    many = fb.estimate_batch(
        np.stack([RECORD.values] * 2), SYSTEM, sampling_rate=100.0, method=outsider, prior={"guess": 0.2}
    )
    np.testing.assert_allclose(many["friction_mean"], one.friction.mean(), rtol=1e-9)
    np.testing.assert_allclose(many["friction_interval90"][1], one.friction.ppf([0.05, 0.95]), rtol=1e-9)
    tree = fb.sample_reference(RECORD, SYSTEM, method=outsider, prior={"guess": 0.2}, seed=1)
    sampled = tree["posterior"]["friction"]
    error = float(sampled.attrs["mcse_mean"])
    assert sampled.attrs["ess_bulk"] > 1000.0
    assert float(sampled.mean()) == pytest.approx(one.friction.mean(), abs=5.0 * error)
    with pytest.raises(fb.InputError, match="unknown key 'mu'; give guess"):
        fb.estimate(RECORD, SYSTEM, method=outsider, prior={"mu": 0.1})


def test_an_unknown_method_is_refused_by_all_alike() -> None:
    message = "method: unknown method 'gibbs'; give one of waveform, envelope, normal-gamma"
    with pytest.raises(fb.InputError, match=message):
        fb.estimate(RECORD, SYSTEM, method="gibbs")
    with pytest.raises(fb.InputError, match=message):
        fb.estimate_batch(RECORD.values[None], SYSTEM, sampling_rate=100.0, method="gibbs")
    with pytest.raises(fb.InputError, match=message):
        fb.sample_reference(RECORD, SYSTEM, method="gibbs", seed=1)
