"""Whether a decay says more from a later turning point on, or up to an earlier one."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import xarray as xr

from experiments.ordinary_records import RECIPES
from friction_bayes import Oscillator, close_loop, estimate, estimate_batch, make_record, simulate
from friction_bayes.core.errors import InputError, RecordWarning
from friction_bayes.decay.free_decay import FreeDecay, find_free_decay
from friction_bayes.estimators.base import Fit
from friction_bayes.estimators.waveform.averaged import averaged_over_accounts
from friction_bayes.estimators.waveform.estimator import WaveformEstimator
from friction_bayes.estimators.waveform.free_part import free_part

SYSTEM = Oscillator(mass=10.0, stiffness=1000.0)
FRICTION = 0.3
QUANTITIES = ("displacement", "velocity", "acceleration")


def test_a_later_part_that_cannot_be_fitted_leaves_the_whole(seed: int) -> None:
    record = simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=0.02,
        duration=8.0,
        sampling_rate=200.0,
        noise_sd=1e-5,
        effects={"random_force.sd": 0.15, "random_force.correlation_time": 0.1},
        seed=seed,
    )
    estimator, fitted = WaveformEstimator(), []

    def fit_of(decay: FreeDecay) -> Fit:
        fitted.append(decay.later)
        if decay.later:
            raise InputError("record", "no free decay under dry friction fits", "give another")
        return estimator.fit(decay, estimator.default_prior(decay), peaks="highest")

    decay = find_free_decay(record, SYSTEM)
    used, fit, accounts = free_part(decay, fit_of)
    fit = averaged_over_accounts(used, fit, accounts.all)
    assert set(fitted) == {0, 1}
    assert used is decay
    assert fit.random_force is not None
    assert fit.answer.mean() == pytest.approx(FRICTION / 1000.0, rel=0.3)
    assert np.isfinite(fit.answer.std())


def test_an_accelerometer_that_shows_the_end_of_a_release_is_fitted_from_later_on(seed: int) -> None:
    """A hand that lets go within a few hundredths of a second: too short for the steps of half periods."""
    record = simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=0.02,
        duration=9.0,
        sampling_rate=200.0,
        quantity="acceleration",
        noise_sd=1e-2,
        seed=seed,
    )
    values = record.values.copy()
    values[:12] += np.linspace(0.5, 0.1, 12)
    hold = 1e-2 * np.random.default_rng(seed).standard_normal(100)
    samples = np.concatenate([hold, values])
    held = make_record(np.arange(samples.size) / 200.0, samples, "acceleration")
    with pytest.warns(UserWarning, match="is left out"):
        found = estimate(held, SYSTEM)
    assert found.decay.later == 1
    low, high = found.friction.interval(0.9)
    assert low < FRICTION < high < 1.1 * low


def test_an_acceleration_may_jump_where_the_mass_turns_under_a_hand() -> None:
    """As a smooth curve alone the hand is less probable than a random force, and the interval 46 % wide."""
    held = RECIPES["hand at the start"](np.random.default_rng(5), 2)
    assert held.quantity == "acceleration"
    record = make_record(held.times, held.values, held.quantity, synthetic=True)
    with pytest.warns(RecordWarning, match="under a hand"):
        found = estimate(record, Oscillator(mass=held.mass, stiffness=held.stiffness))
    assert found.decay.later == 1
    low, high = found.friction.interval(0.9)
    assert high - low < 2e-3 * found.friction.mean()
    truth = held.truth(found.decay.start_time, found.decay.start_time + found.decay.duration)
    assert found.friction.mean() == pytest.approx(truth, abs=2.0 * (high - low))


def stopped(
    quantity: str, seed: int, stop: float = 4.1, over: float = 0.15, damping_ratio: float = 0.0
) -> xr.DataArray:
    """A decay that a hand stops smoothly within a time constant ``over`` [s], and holds until 6.5 s."""

    def decay(quantity: str) -> xr.DataArray:
        effects = {"viscous_damping.damping_ratio": damping_ratio} if damping_ratio else {}
        return simulate(
            SYSTEM,
            friction=FRICTION,
            initial_displacement=0.02,
            duration=6.5,
            sampling_rate=200.0,
            quantity=quantity,
            effects=effects,
            seed=seed,
        )

    record, motion = decay(quantity), decay("displacement")
    order = QUANTITIES.index(quantity)
    time, x = motion["time"].values, motion.values
    held = time >= stop
    first, u = int(np.argmax(held)), (time[held] - time[held][0]) / over
    a, b = x[first], x[first] + over * (x[first + 1] - x[first - 1]) * 100.0
    values = record.values.copy()
    # (a + b u) exp(-u) goes on with place and speed
    ways = (a + b * u, (b - a - b * u) / over, (a - 2.0 * b + b * u) / over**2)
    values[held] = ways[order] * np.exp(-u)
    noise = 1e-4 * 10.0**order * np.random.default_rng(seed).standard_normal(values.size)
    return make_record(time, values + noise, quantity, synthetic=True)


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize(("over", "damping_ratio"), [(0.15, 0.0), (0.15, 0.004), (0.05, 0.0)])
def test_a_mass_that_a_hand_stops_is_fitted_until_then(
    quantity: str, over: float, damping_ratio: float
) -> None:
    """Friction was 1.3 to 5 times too large, what stopped the mass being a random force.

    A mass with damping too, or one that is stopped nearly at once.
    """
    record = stopped(quantity, seed=4, over=over, damping_ratio=damping_ratio)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = estimate(record, SYSTEM)
    assert any("as where a hand stops the mass" in str(each.message) for each in caught)
    assert found.decay.earlier > 0
    assert 3.5 < found.decay.start_time + found.decay.duration < 4.2
    low, high = found.friction.interval(0.98)
    assert low < FRICTION < high < (1.8 if damping_ratio else 1.15) * low


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_mass_that_friction_stops_is_fitted_to_the_end(quantity: str, seed: int) -> None:
    """Under damping too, and under a force that fluctuates."""
    for effects in (
        {},
        {"viscous_damping.damping_ratio": 0.004},
        {"random_force.sd": 0.1 * FRICTION, "random_force.correlation_time": 0.1},
    ):
        record = simulate(
            SYSTEM,
            friction=FRICTION,
            initial_displacement=0.02,
            duration=12.0,
            sampling_rate=200.0,
            quantity=quantity,
            noise_sd=1e-4 * 10.0 ** QUANTITIES.index(quantity),
            effects=effects,
            seed=seed,
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RecordWarning)
            assert estimate(record, SYSTEM).decay.earlier == 0


def test_a_batch_and_the_loop_leave_out_what_a_hand_does_too() -> None:
    record = stopped("displacement", seed=4)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordWarning)
        one = estimate(record, SYSTEM)
        many = estimate_batch(record.expand_dims("record"), SYSTEM, random_force="auto")
        force = FRICTION * np.sign(np.gradient(record.values))
        report = close_loop([record], SYSTEM, reference_force=force)
    assert many["friction_mean"].item() == pytest.approx(one.friction.mean(), rel=1e-9)
    place = many["warnings"].attrs["flag_meanings"].split().index("earlier_end")
    assert many["warnings"].item() >> place & 1
    assert report.verdict == "adequate"
    assert any("as where a hand stops the mass" in note for note in report.notes)
    compared = report.residual["force"]
    # all but the samples nearest to a turning point
    assert compared["after"] < 0.4 * FRICTION
