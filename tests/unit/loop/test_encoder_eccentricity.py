"""An error of the encoder that repeats with every turn, beside a force that fluctuates."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from fluctuating_force import fluctuating_decay
from friction_bayes.core.errors import InputError
from friction_bayes.loop.random_force.fit import ForceFit, fit_random_force
from friction_bayes.loop.segment import cut_records

SYSTEM = fb.Oscillator(inertia=1.0, stiffness=100.0)
STEP, NOISE = 0.01, 3e-4
OFFERED = ("viscous_damping", "cubic_stiffness", "sensor_offset", "encoder_eccentricity")


def record(rng: np.random.Generator, size: float, *, release: float = 2.5):  # type: ignore[no-untyped-def]
    """A wheel between springs, read by an encoder that errs once and twice a turn."""
    friction = release / 100.0
    angle = fluctuating_decay(
        rng,
        frequency=10.0,
        friction=friction,
        release=release,
        step=STEP,
        samples=1500,
        force_sd=0.1 * friction,
        correlation_time=0.1,
    )[0]
    read = angle + size * np.sin(angle + 0.7) + 0.5 * size * np.sin(2.0 * angle - 1.0)
    return fb.make_record(
        STEP * np.arange(angle.size), read + NOISE * rng.standard_normal(angle.size), "angle"
    )


def fitted(decay) -> ForceFit:  # type: ignore[no-untyped-def]
    (segment,) = cut_records([decay], SYSTEM)
    found = fit_random_force(segment, SYSTEM, OFFERED)
    assert found is not None
    return found


def probability(fit: ForceFit) -> float:
    inside = np.array(["encoder_eccentricity" in names for names in fit.sets.effects])
    return float(fit.posterior.weight[:, inside].sum())


def test_it_is_found_and_friction_with_it(rng: np.random.Generator) -> None:
    fit = fitted(record(rng, 0.002))
    assert probability(fit) > 0.99
    found = dict(zip([c.parameter for c in fit.law.columns], fit.coefficients, strict=True))
    assert found["once_cosine"] == pytest.approx(0.002 * np.sin(0.7), rel=0.3)
    assert np.hypot(found["twice_sine"], found["twice_cosine"]) == pytest.approx(0.001, rel=0.3)
    assert fit.posterior.noise_sd == pytest.approx(NOISE, rel=0.1)
    assert fit.coefficients[fit.law.dry_friction] == pytest.approx(0.025, rel=0.05)


def test_a_small_swing_cannot_tell_it_from_offset_and_gain(rng: np.random.Generator) -> None:
    fit = fitted(record(rng, 0.002, release=1.2))
    assert not any("encoder_eccentricity" in names for names in fit.sets.effects)


def test_a_sensor_of_displacement_has_no_turns() -> None:
    with pytest.raises(InputError, match="encoder_eccentricity"):
        fb.simulate(
            fb.Oscillator(mass=1.0, stiffness=100.0),
            friction=0.02,
            initial_displacement=0.02,
            duration=2.0,
            sampling_rate=100.0,
            effects={"encoder_eccentricity.once_sine": 0.001},
        )
