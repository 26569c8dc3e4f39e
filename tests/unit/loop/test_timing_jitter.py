"""Sample times that jitter: noise that grows with the rate of the signal, with a force that fluctuates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import expit

import friction_bayes as fb
from friction_bayes.mechanics.effects import EFFECTS
from unsteady_decays import RELEASE, STEP, SYSTEM, fitted, jittered_record

NOISE = 4e-5


@pytest.mark.parametrize("order", [0, 1])
def test_jitter_is_found_with_its_size_and_leaves_the_sensors_noise(
    rng: np.random.Generator, order: int
) -> None:
    # at full speed as large as the noise
    record = jittered_record(rng, 0.04 * STEP, NOISE, order)
    fit = fitted(record, ("viscous_damping", "timing_jitter", "sensor_offset"))
    assert fit.growth is not None
    assert expit(fit.growth.log_odds) > 0.99
    assert fit.posterior.noise_sd == pytest.approx(NOISE * (10.0 / fit.w0) ** order, rel=0.1)
    jitter = fit.growth.ratio * fit.posterior.noise_sd
    assert jitter == pytest.approx(0.04 * STEP, rel=0.3)
    assert abs(np.log(jitter / (0.04 * STEP))) < 5.0 * fit.growth.log_sd
    # the innovations are of one size at any speed
    fast = np.abs(fit.path.v) > np.median(np.abs(fit.path.v))
    assert np.var(fit.innovations[fast]) == pytest.approx(np.var(fit.innovations[~fast]), rel=0.3)


def test_the_report_names_it_with_its_unit(rng: np.random.Generator) -> None:
    report = fb.close_loop([jittered_record(rng, 0.1 * STEP, NOISE)], SYSTEM, seed=1)
    named = {effect["name"]: effect for effect in report.effects}
    jitter = named["timing_jitter"]
    assert jitter["probability"] > 0.99
    assert jitter["parameters"]["sd"]["unit"] == "s"
    assert jitter["parameters"]["sd"]["mean"] == pytest.approx(0.1 * STEP, rel=0.3)
    assert report.noise["sd"] == pytest.approx(NOISE, rel=0.2)
    assert sum(c["probability"] for c in report.candidates) == pytest.approx(1.0)
    assert (report.posterior["posterior"]["timing_jitter.sd"] > 0.0).all()
    assert report.held_out_error["inside90"] > 0.6


def test_of_several_records_each_that_has_it_has_a_size_of_its_own(rng: np.random.Generator) -> None:
    records = [jittered_record(rng, size, NOISE) for size in (0.0, 0.1 * STEP)]
    report = fb.close_loop(records, SYSTEM, seed=1, effects=["viscous_damping", "timing_jitter"])
    (jitter,) = (effect for effect in report.effects if effect["name"] == "timing_jitter")
    assert list(jitter["parameters"]) == ["sd[1]"]
    assert jitter["parameters"]["sd[1]"]["mean"] == pytest.approx(0.1 * STEP, rel=0.3)
    assert (report.posterior["posterior"]["timing_jitter.sd[1]"] > 0.0).all()


def test_many_records_without_it_do_not_add_up_to_it(rng: np.random.Generator) -> None:
    """Each leaves it a few per cent."""
    records = [jittered_record(rng, 0.0, NOISE) for _ in range(4)]
    found = [
        sum(c["probability"] for c in report.candidates if "timing_jitter" in c["effects"])
        for report in (
            fb.close_loop(some, SYSTEM, seed=1, effects=["viscous_damping", "timing_jitter"])
            for some in (*([each] for each in records), records)
        )
    ]
    assert min(found[:-1]) > 0.0
    assert found[-1] < 1.5 * np.mean(found[:-1])


def test_where_it_may_not_act_it_is_not_evaluated(rng: np.random.Generator) -> None:
    record = jittered_record(rng, 0.1 * STEP, NOISE)
    assert fitted(record, ("viscous_damping",)).growth is None


def test_simulated_jitter_is_noise_in_proportion_to_the_rate() -> None:
    def decay(**effects: float):  # type: ignore[no-untyped-def]
        return fb.simulate(
            SYSTEM,
            friction=0.02,
            initial_displacement=RELEASE,
            duration=20.0,
            sampling_rate=1.0 / STEP,
            seed=1,
            effects=effects,
        )

    clean = decay().values
    late = decay(**{"timing_jitter.sd": 1e-3}).values - clean
    rate = np.gradient(clean, STEP)
    moving = np.abs(rate) > 0.1 * np.abs(rate).max()
    assert np.std(late[moving] / rate[moving]) == pytest.approx(1e-3, rel=0.1)
    assert EFFECTS["timing_jitter"].parameters[0].unit == "s"
