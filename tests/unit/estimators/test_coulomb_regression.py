"""Estimates averaged over a random force: every sensor, every system, and what is reported."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import SYSTEM, slow_decay
from fluctuating_force import fluctuating_decay
from friction_bayes.core.errors import InputError
from friction_bayes.estimators.result import Estimate
from friction_bayes.report.estimate_story import estimate_story

FREQUENCY, RELEASE, FRICTION, STEP = 10.0, 0.1, 0.001, 0.02
LINEAR = fb.Oscillator(mass=2.0, stiffness=200.0)
QUANTITIES = ("displacement", "velocity", "acceleration")


def motion(rng: np.random.Generator, share: float, release: float = RELEASE) -> dict[int, np.ndarray]:
    return fluctuating_decay(
        rng,
        frequency=FREQUENCY,
        friction=FRICTION * release / RELEASE,
        release=release,
        step=STEP,
        samples=800,
        force_sd=share * FRICTION * release / RELEASE,
        correlation_time=0.1,
    )


def noisy_record(
    values: np.ndarray, quantity: str, rng: np.random.Generator, unit: str | None = None
) -> xr.DataArray:
    noisy = values + 0.003 * np.abs(values).max() * rng.standard_normal(values.size)
    return fb.make_record(STEP * np.arange(values.size), noisy, quantity, unit=unit)


def estimated(values: np.ndarray, quantity: str, rng: np.random.Generator, **options) -> Estimate:
    record = noisy_record(values, quantity, rng, options.pop("unit", None))
    return fb.estimate(record, options.pop("system", LINEAR), **options)


def simulated(system: fb.Oscillator = LINEAR, **changes) -> xr.DataArray:
    settings = {
        "friction": 0.2,
        "initial_displacement": RELEASE,
        "duration": 20.0,
        "sampling_rate": 100.0,
        "noise_sd": 0.0,
        "seed": 1,
    }
    return fb.simulate(system, **settings | changes)


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_a_random_force_without_noise_of_the_sensor(rate: float) -> None:
    """The noise is nowhere below its level near the motion, where the force alone is seen."""
    force = {"random_force.sd": 0.06, "random_force.correlation_time": 0.1}
    record = simulated(initial_displacement=0.02, sampling_rate=rate, duration=15.0, effects=force)
    found = fb.estimate(record, LINEAR)
    assert found.random_force is not None
    assert found.random_force.probability > 0.99
    # corners of any shape, which so strong a force can make the more probable, cost a quarter of the width
    assert abs(found.friction.mean() - 0.2) < 4.0 * found.friction.std() < 0.062


@pytest.mark.parametrize("quantity", ["velocity", "acceleration"])
def test_a_force_in_a_short_record_is_not_taken_for_noise(quantity: str) -> None:
    """Three periods: near the motion the force is stronger than the noise, which shows far above alone."""
    force = {"random_force.sd": 0.05, "random_force.correlation_time": 0.3}
    noise = {"velocity": 6e-4, "acceleration": 2e-2}[quantity]
    record = simulated(
        initial_displacement=0.02,
        duration=2.0,
        sampling_rate=400.0,
        quantity=quantity,
        noise_sd=noise,
        effects=force,
    )
    found = fb.estimate(record, LINEAR)
    assert found.random_force is not None
    assert found.random_force.probability > 0.99
    assert found.to_dict()["noise"]["sd"] == pytest.approx(noise, rel=0.1)
    assert abs(found.friction.mean() - 0.2) < 3.0 * found.friction.std()


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_fluctuating_force_widens_the_interval_and_is_reported(order: int, rng) -> None:
    values = motion(rng, 0.3)[order]
    found = estimated(values, QUANTITIES[order], rng)
    truth = FRICTION * LINEAR.stiffness
    force = found.random_force
    assert force is not None
    assert force.probability > 0.99
    assert abs(found.friction.mean() - truth) < 4.0 * found.friction.std()
    plain = estimated(values, QUANTITIES[order], rng, random_force="none")
    assert 3.0 * plain.friction.std() < found.friction.std() < 0.1 * truth
    assert 0.1 < force.share_of_friction < 0.9
    assert force.sd.mean() == pytest.approx(0.3 * truth, rel=0.7)
    assert force.correlation_time.mean() == pytest.approx(0.1, rel=2.0)
    noise = 0.003 * np.abs(values).max()
    assert found.noise_sd == pytest.approx(noise, rel=0.1)
    assert found.frequency == pytest.approx(FREQUENCY, abs=4.0 * found.frequency_sd)
    report = found.to_dict()
    assert report["random_force"]["sd"]["unit"] == "N"
    assert report["random_force"]["correlation_time"]["unit"] == "s"
    low, high = report["friction"]["interval90"]
    assert low <= report["friction"]["mean"] <= high
    rests = dict(estimate_story(report))["it rests on"]
    assert rests.startswith("white noise of the sensor and a force that fluctuates: probability > 9")
    assert not any("residuals are not white" in note for note in report["notes"])


def test_an_effect_that_passes_for_a_random_force_is_doubted() -> None:
    plain = slow_decay(duration=20.0, noise_sd=2e-5, seed=1)
    hum = 1e-4 * np.sin(1.4 * SYSTEM.natural_frequency * plain["time"].values)
    found = fb.estimate(plain.copy(data=plain.values + hum), SYSTEM)
    assert found.random_force is not None
    assert found.random_force.probability > 0.5
    assert any("can pass for such a force" in note for note in found.notes)


def test_a_stiffness_that_changes_with_the_swing_is_no_random_force() -> None:
    stiffer = {"cubic_stiffness.cubic_stiffness": 1e5}
    found = fb.estimate(slow_decay(duration=20.0, noise_sd=2e-5, seed=1, effects=stiffer), SYSTEM)
    assert found.random_force.probability < 0.01
    low, high = found.friction.interval(0.98)
    assert low < 0.07 < high
    assert high - low < 0.1 * 0.07


@pytest.mark.parametrize(
    "loss",
    [
        # the others are in test_other_forces.py
        {"viscous_damping.damping_ratio": 0.002},
        {"stribeck_friction.static_excess": 0.6, "stribeck_friction.stribeck_velocity": 0.02},
    ],
)
def test_another_loss_than_by_dry_friction_is_no_random_force(loss: dict[str, float]) -> None:
    with pytest.warns(fb.RecordWarning, match="while it is larger"):
        found = fb.estimate(slow_decay(duration=20.0, noise_sd=2e-5, seed=1, effects=loss), SYSTEM)
    assert found.random_force.probability < 0.01
    low, high = found.friction.interval(0.98)
    assert low < 0.07 < high
    assert high - low < 0.1 * 0.07


def test_without_it_the_numbers_are_nearly_those_of_the_plain_fit(rng) -> None:
    values = motion(rng, 0.0)[0]
    record = noisy_record(values, "displacement", rng)
    both = fb.estimate(record, LINEAR)
    plain = fb.estimate(record, LINEAR, random_force="none")
    assert both.random_force is not None
    assert both.random_force.probability < 0.3
    assert plain.random_force is None
    assert plain.to_dict()["random_force"] is None
    assert (
        abs(both.random_force.coefficient_without.mean() - plain.friction.mean()) < 0.5 * plain.friction.std()
    )
    assert abs(both.friction.mean() - plain.friction.mean()) < 0.5 * plain.friction.std()
    # the part with a force, whose size goes to zero, contains the plain law
    assert both.random_force.coefficient_with.cdf(plain.friction.mean()) == pytest.approx(0.5, abs=0.4)
    assert np.array_equal(both.fit.prediction, plain.fit.prediction)


def test_rest_position_units_and_systems(rng) -> None:
    values = motion(rng, 0.3)[0]
    free = estimated(values + 0.5, "displacement", np.random.default_rng(1))
    known = estimated(values + 0.5, "displacement", np.random.default_rng(1), rest_position=0.5)
    assert known.random_force.probability == pytest.approx(free.random_force.probability, abs=0.05)
    assert abs(known.friction.mean() - free.friction.mean()) < free.friction.std()
    assert known.friction.std() < 1.05 * free.friction.std()
    free = estimated(values, "displacement", np.random.default_rng(1))
    volts = estimated(values, "displacement", np.random.default_rng(1), unit="V")
    assert volts.random_force.sd.mean() == pytest.approx(free.random_force.sd.mean() / 200.0, rel=0.2)
    assert volts.to_dict()["random_force"]["sd"]["unit"] == "V"
    wheel = fb.Oscillator(inertia=0.02, stiffness=2.0)
    angle = estimated(values, "angle", np.random.default_rng(1), system=wheel)
    assert angle.random_force.sd.mean() == pytest.approx(0.01 * free.random_force.sd.mean(), rel=0.2)
    # a swing of 0.1 rad is that of a pendulum but for 0.06 % of the frequency
    swing = estimated(
        values, "angle", np.random.default_rng(1), system=fb.Pendulum(inertia=0.02, stiffness=2.0)
    )
    assert swing.random_force.probability > 0.99
    assert abs(swing.friction.mean() - angle.friction.mean()) < 0.5 * angle.friction.std()


def test_a_pendulum_at_large_swings(rng) -> None:
    system = fb.Pendulum(inertia=0.02, stiffness=2.0)
    record = simulated(system, friction=0.02, initial_displacement=1.0, noise_sd=0.003, seed=4)
    found = fb.estimate(record, system)
    assert found.random_force is not None
    assert found.random_force.probability < 0.3
    assert found.random_force.coefficient_with.cdf(0.02) == pytest.approx(0.5, abs=0.499)
    assert found.friction.mean() == pytest.approx(0.02, rel=0.02)


@pytest.mark.parametrize("seed", [0, 6, 7])
def test_far_swings_of_an_accelerometer_are_smoothed_until_slopes_serve(seed: int) -> None:
    """The first motion, from the acceleration alone, is so far off that noise along it showed a force."""
    system = fb.Pendulum(inertia=0.5, stiffness=12.5)
    record = fb.simulate(
        system,
        friction=0.152,
        initial_displacement=1.2,
        duration=20.1,
        sampling_rate=43.0,
        quantity="angular_acceleration",
        noise_sd=0.15,
        seed=seed,
    )
    found = fb.estimate(record, system)
    assert found.random_force is not None
    assert found.random_force.probability < 0.3


def test_what_says_nothing_of_a_force_keeps_the_plain_numbers() -> None:
    assert fb.estimate(simulated(), LINEAR).random_force is None
    short = simulated(duration=2.0, sampling_rate=5.5, noise_sd=1e-3)
    assert fb.estimate(short, LINEAR).random_force is None
    assert fb.estimate(simulated(), LINEAR, method="envelope").random_force is None
    with pytest.raises(InputError, match=r"random_force: unknown choice 'some'"):
        fb.estimate(short, LINEAR, random_force="some")
