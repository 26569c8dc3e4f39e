"""Default priors: scale with the system, count for nothing next to data, and can all be set."""

from __future__ import annotations

import numpy as np
import pytest

from decays import SYSTEM
from friction_bayes.conjugate.gamma_exponential import GammaExponential
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.conjugate.regression import NormalInverseGamma
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.core.system import Oscillator, Pendulum
from friction_bayes.estimators.priors import (
    PRIORS,
    complete_prior,
    default_prior,
    force_scale,
    prior_keys,
    signal_scale,
)

DISPLACEMENT, ACCELERATION, ANGLE = (QUANTITIES[q] for q in ("displacement", "acceleration", "angle"))


def test_scales_come_from_the_system() -> None:
    assert force_scale(SYSTEM, DISPLACEMENT, "m") == pytest.approx(98.0665)
    assert signal_scale(SYSTEM, DISPLACEMENT, "m") == pytest.approx(0.0980665)
    assert signal_scale(SYSTEM, ACCELERATION, "m/s2") == pytest.approx(9.80665)
    pendulum = Pendulum(inertia=0.01, stiffness=0.3)
    assert force_scale(pendulum, ANGLE, "rad") == 0.3
    assert signal_scale(pendulum, ANGLE, "rad") == 1.0
    assert force_scale(SYSTEM, DISPLACEMENT, "V") == signal_scale(SYSTEM, ACCELERATION, "V") == 10.0


# The unit each default carries: of the friction for the paper's two, of the signal for the others.
POWERS = {
    "normal-gamma": ("force", {"mu": 1, "lam": 0, "alpha": 0, "beta": 2}),
    "gamma-exponential": ("force", {"alpha": 0, "kappa": 1}),
    "envelope": ("signal", {"coefficient_precision": 0, "alpha": 0, "beta": 2}),
    "waveform": ("signal", {"coefficient_precision": 0, "alpha": 0, "beta": 2}),
}


@pytest.mark.parametrize("method", PRIORS)
def test_priors_do_not_depend_on_units(method: str) -> None:
    """Twice the forces of the same motion, or its velocity, ten times as large a number: the same prior."""
    unit, powers = POWERS[method]
    base = default_prior(method, SYSTEM, DISPLACEMENT, "m")
    heavier = default_prior(method, Oscillator(mass=20.0, stiffness=2000.0), DISPLACEMENT, "m")
    velocity = default_prior(method, SYSTEM, QUANTITIES["velocity"], "m/s")
    force, signal = (2.0, 1.0) if unit == "force" else (1.0, 10.0)
    assert heavier == pytest.approx({key: base[key] * force**power for key, power in powers.items()})
    assert velocity == pytest.approx({key: base[key] * signal**power for key, power in powers.items()})
    assert prior_keys(method) == tuple(powers)
    assert all(parameter.reason for parameter in PRIORS[method])


def test_normal_gamma_default_is_weak() -> None:
    prior = NormalGamma(**default_prior("normal-gamma", SYSTEM, DISPLACEMENT, "m"))
    samples = np.array([0.071, 0.069, 0.072, 0.068])
    after = prior.update(samples)
    assert after.mu == pytest.approx(samples.mean(), rel=1e-11)
    assert after.beta == pytest.approx(0.5 * np.sum((samples - 0.07) ** 2), rel=1e-2)
    # friction is as likely beyond the weight of the mass as below it
    assert prior.friction.cdf(98.0665) == pytest.approx(0.75)


def test_gamma_exponential_default_is_weak() -> None:
    prior = GammaExponential(**default_prior("gamma-exponential", SYSTEM, DISPLACEMENT, "m"))
    assert prior.update(np.full(50, 0.07)).friction.mean() == pytest.approx(1.0 / 0.07, rel=1e-3)


def test_regression_default_is_weak(rng: np.random.Generator) -> None:
    given = default_prior("waveform", SYSTEM, DISPLACEMENT, "m")
    prior = NormalInverseGamma.from_prior(
        mean=np.zeros(2), precision=given["coefficient_precision"], alpha=given["alpha"], beta=given["beta"]
    )
    design = np.column_stack([np.ones(40), np.arange(40.0)])
    response = design @ [0.0143, -1.4e-4] + rng.normal(0.0, 5e-4, 40)
    after = prior.update(design, response)
    least_squares, (rss,), *_ = np.linalg.lstsq(design, response)
    assert after.mean == pytest.approx(least_squares, rel=1e-9)
    assert after.beta == pytest.approx(0.5 * rss, rel=1e-6)


def test_every_key_can_be_set_and_no_other() -> None:
    default = default_prior("normal-gamma", SYSTEM, DISPLACEMENT, "m")
    assert complete_prior("normal-gamma", default, None) == default
    assert complete_prior("normal-gamma", default, {"mu": 0.1})["mu"] == 0.1
    assert default["mu"] == 0.0
    with pytest.raises(InputError, match="unknown key 'kappa'; give one of mu, lam, alpha, beta"):
        complete_prior("normal-gamma", default, {"kappa": 1.0})
    with pytest.raises(InputError, match="prior lam: nan is not finite"):
        complete_prior("normal-gamma", default, {"lam": float("nan")})
    with pytest.raises(InputError, match=r"prior alpha: -1 is too small for normal-gamma; give -0.5 or more"):
        complete_prior("normal-gamma", default, {"alpha": -1.0})


@pytest.mark.parametrize("method", PRIORS)
def test_no_default_is_refused(method) -> None:
    default = default_prior(method, SYSTEM, DISPLACEMENT, "m")
    assert complete_prior(method, {}.fromkeys(default, 0.0), default) == default
