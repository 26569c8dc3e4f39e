"""Few samples: the noise of an account is integrated out, not taken as found."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import logsumexp

import friction_bayes as fb
from friction_bayes.estimators.noise.coulomb_regression import PlainDecay, PreparedDecay
from friction_bayes.estimators.noise.noise_accounts import noise_accounts
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
    white = noise_accounts(decay)[0]
    assert white.of_known_noise
    mean, sd, noise = by_quadrature(Problem.of(PreparedDecay(decay).along_fit().regression))
    # the account has the coefficient at the frequency found
    unit = white.frequency**-2
    assert white.coefficient.mean() == pytest.approx(mean * unit, abs=0.005 * sd)
    assert white.coefficient.std() == pytest.approx(sd * unit, rel=0.005)
    assert white.noise_sd == pytest.approx(noise, rel=0.005)
