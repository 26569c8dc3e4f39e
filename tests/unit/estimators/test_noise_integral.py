"""Few samples: the noise of an account is integrated out, not taken as found."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.special import logsumexp

import friction_bayes as fb
from friction_bayes.estimators.noise import noise_accounts as accounts_module
from friction_bayes.estimators.noise.coulomb_regression import Laid, PlainDecay, PreparedDecay
from friction_bayes.estimators.noise.filter_evidence import FoundFilters, FoundKind
from friction_bayes.estimators.noise.noise_accounts import NoiseAccounts
from friction_bayes.estimators.noise.noise_integral import over_noise
from friction_bayes.estimators.noise.recording_filters import kinds_for
from friction_bayes.statespace.force_grid import Posterior
from friction_bayes.statespace.force_prior import ForcePrior
from friction_bayes.statespace.problem import Problem

SYSTEM = fb.Oscillator(mass=1.0, stiffness=1.0)
FRICTION, RELEASE, NOISE = 0.01, 1.0, 0.01


def plain_decay(step: float, rng: np.random.Generator) -> PlainDecay:
    """Seventy samples of a sensor with steps, and the motion that was simulated."""
    motion = [
        fb.simulate(
            SYSTEM,
            friction=FRICTION,
            initial_displacement=RELEASE,
            duration=23.0,
            sampling_rate=3.0,
            quantity=quantity,
            seed=1,
        ).values
        for quantity in ("displacement", "velocity")
    ]
    noisy = motion[0] + (NOISE * rng.standard_normal(motion[0].size) if step == 0.0 else 0.0)
    return PlainDecay(
        values=np.round(noisy / step) * step if step > 0.0 else noisy,
        time=np.arange(noisy.size) / 3.0,
        order=0,
        frequency=1.0,
        coefficient=FRICTION,
        rest_position=0.0,
        states=np.column_stack(motion),
        phase_sd=1e-3,
        noise_sd=max(NOISE, step / math.sqrt(12.0)),
    )


def test_a_filter_that_is_not_found_again_is_the_one_that_was_found(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Behind a filter the frequency differs: the record may be too short at it, or lack sizes of the kind."""
    prepared = PreparedDecay(plain_decay(0.0, rng))
    mean = kinds_for(1.0 / 3.0, 0)[0]
    monkeypatch.setattr(Laid, "filters_along", lambda self, only: FoundFilters())
    kind = FoundKind(mean.name, [(0.0, mean.of(2.0))])
    ((share, laid),) = prepared.along_fit().behind_kind(kind)
    assert share == 1.0
    assert laid.filter is kind.filters[0][1]


def by_quadrature(problem: Problem) -> tuple[float, float, float]:
    """Mean and sd of friction, and mean noise, natural units: by a fine grid of the noise above its floor."""
    j, whitened = problem.names.index("friction"), problem.marginal(0.0, 1.0)
    gram, n, unit = whitened.gram, problem.used, np.eye(problem.reference.size)
    floor = problem.log_least_variance
    log_v = np.linspace(max(floor, -15.0), max(floor, -15.0) + 12.0, 4001)
    log_weight, mean, variance = np.empty((3, log_v.size))
    for k, v in enumerate(np.exp(log_v)):
        precision = gram[:-1, :-1] / v + unit
        change = gram[:-1, -1] / v - problem.reference
        moved = np.linalg.solve(precision, change)
        misfit = gram[-1, -1] / v - change @ moved
        log_weight[k] = -0.5 * (n * log_v[k] + misfit + np.linalg.slogdet(precision)[1])
        mean[k] = problem.reference[j] + moved[j]
        variance[k] = np.linalg.inv(precision)[j, j]
    share = np.exp(log_weight - logsumexp(log_weight))
    centre = float(share @ mean)
    sd = math.sqrt(float(share @ (variance + (mean - centre) ** 2)))
    return centre * problem.scale[j], sd * problem.scale[j], float(share @ np.exp(0.5 * log_v))


@pytest.mark.parametrize("step", [0.0, 0.05])
def test_friction_and_noise_are_those_of_a_fine_grid(step: float, rng: np.random.Generator) -> None:
    decay = plain_decay(step, rng)
    white = NoiseAccounts(decay).all[0]
    assert white.of_known_noise
    mean, sd, noise = by_quadrature(Problem.of(PreparedDecay(decay).along_fit().regression))
    # the account has the coefficient at the frequency found
    unit = white.frequency**-2
    assert white.coefficient.mean() == pytest.approx(mean * unit, abs=0.005 * sd)
    assert white.coefficient.std() == pytest.approx(sd * unit, rel=0.005)
    assert white.noise_sd == pytest.approx(noise, rel=0.005)


def test_of_many_samples_little_changes_whatever_the_corners(
    monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """Corners far from their prior leave the noise as it is, as for a sampler: that is its unit."""
    changes: list[tuple[bool, float, float]] = []

    def compared(problem: Problem, posterior: Posterior, prior: ForcePrior) -> Posterior:
        found = over_noise(problem, posterior, prior)
        before, after = posterior.coefficient("friction"), found.coefficient("friction")
        shift = (after.mean() - before.mean()) / before.std()
        changes.append((bool(problem.own.any()), after.std() / before.std(), shift))
        return found

    monkeypatch.setattr(accounts_module, "over_noise", compared)
    motion = {"friction": 0.01, "initial_displacement": 1.0, "duration": 60.0, "sampling_rate": 25.0}
    record = fb.simulate(SYSTEM, **motion, noise_sd=1e-4, seed=seed)
    velocity = fb.simulate(SYSTEM, **motion, quantity="velocity").values
    # the sensor lags where the motion is slow
    record = record.copy(data=record.values - 0.03 * np.sign(velocity) * np.exp(-((velocity / 0.05) ** 2)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.RecordWarning)
        fb.estimate(record, SYSTEM)
    assert {own for own, _, _ in changes} == {False, True}
    for _, width, shift in changes:
        assert 1.0 < width < 1.02
        assert abs(shift) < 0.02
