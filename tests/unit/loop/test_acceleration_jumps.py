"""The acceleration jumps at each turning point: the value nearest to it is not fitted, others are exact."""

from __future__ import annotations

import math

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.decay.block_means import amplitude_kept, block_means
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import DISPLACEMENT, FRICTION, LOG_FREQUENCY_RATIO, VELOCITY
from friction_bayes.loop.data.prepared_record import Segment, cut_records
from friction_bayes.loop.noise.likelihood import fit_noise, log_densities
from friction_bayes.mechanics.effects import Scales

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)
FRICTION_FORCE, RELEASE = 0.07, 0.0147


def segment(quantity: str, rate: float) -> Segment:
    record = fb.simulate(
        SYSTEM,
        friction=FRICTION_FORCE,
        initial_displacement=RELEASE,
        duration=7.0,
        sampling_rate=rate,
        quantity=quantity,
        noise_sd=1e-6,
        seed=1,
    )
    (cut,) = cut_records([record], SYSTEM)
    return cut


@pytest.mark.parametrize("rate", [37.0, 400.0, 20000.0])
def test_one_value_at_each_turning_point_is_not_fitted(rate: float) -> None:
    cut = segment("acceleration", rate)
    turns = math.pi / 10.0 * np.arange(1, 23)
    middles = cut.decay.start_time + cut.time
    nearest = [int(np.argmin(np.abs(middles - turn))) for turn in turns]
    reach = 0 if cut.block == 1 else 1
    expected = [k + shift for k in nearest for shift in range(-reach, reach + 1)]
    found = np.flatnonzero(cut.ignored)
    # the release, at the first sample, is a turning point too
    assert found[found > reach].tolist() == expected
    assert np.count_nonzero(~cut.free) == found.size


def test_a_smooth_signal_is_fitted_whole() -> None:
    assert segment("displacement", 400.0).free.all()
    assert segment("velocity", 400.0).free.all()


@pytest.mark.parametrize("rate", [400.0, 20000.0])
def test_all_other_values_are_predicted_to_the_noise(rate: float) -> None:
    cut = segment("acceleration", rate)
    model = LoopModel(SYSTEM, (cut,))
    z = np.zeros(len(model.coordinates))
    # the segment starts in the middle of its first block
    start = cut.decay.start_time
    shift = FRICTION_FORCE / SYSTEM.stiffness
    swing = RELEASE - shift
    state = {
        FRICTION: FRICTION_FORCE,
        LOG_FREQUENCY_RATIO: 0.0,
        DISPLACEMENT: shift + swing * math.cos(10.0 * start),
        VELOCITY: -10.0 * swing * math.sin(10.0 * start),
    }
    for j, c in enumerate(model.coordinates):
        z[j] = c.coordinate(state[c.name])
    predicted = model.predict(z, 0)
    assert predicted is not None
    residual = np.abs(cut.values - predicted.signal)
    # half a jump is 7e-3; the noise 1e-6
    assert residual[cut.free].max() < 1e-5
    if cut.block > 1:
        # the mean of a block over a jump is neither side's
        assert residual[cut.ignored].max() > 1e-3


def test_damping_moves_the_jump_no_further_than_what_is_not_fitted() -> None:
    record = fb.simulate(
        SYSTEM,
        friction=FRICTION_FORCE,
        initial_displacement=RELEASE,
        duration=5.0,
        sampling_rate=20000.0,
        quantity="acceleration",
        noise_sd=1e-3,
        seed=1,
        effects={"viscous_damping.damping_ratio": 0.01},
    )
    report = fb.close_loop([record], SYSTEM, seed=1)
    assert [effect["name"] for effect in report.effects] == ["viscous_damping"]
    low, high = report.friction_after["interval90"]
    assert low <= FRICTION_FORCE <= high


@pytest.mark.parametrize("block", [2, 7, 60])
def test_block_means_of_a_sinusoid_keep_the_amplitude_that_is_said(block: int) -> None:
    per_period = 223.7 * block
    angle = 2.0 * math.pi / per_period * np.arange(50 * block)
    middles = block_means(angle, block)
    kept = amplitude_kept(per_period, block)
    assert block_means(np.cos(angle), block) == pytest.approx(kept * np.cos(middles), abs=1e-12)
    assert kept < 1.0 - 1e-5


def test_ignored_samples_do_not_count(rng: np.random.Generator) -> None:
    x = rng.standard_normal(400)
    ignored = np.zeros(400, dtype=bool)
    ignored[[40, 200]] = True
    scales = Scales(
        system=SYSTEM,
        quantity=segment("acceleration", 37.0).decay.quantity,
        amplitude=1.0,
        duration=10.0,
        sampling_rate=40.0,
    )
    flat = np.zeros(400)
    there = fit_noise(x, flat, scales, outliers=False, ignored=ignored)
    known = log_densities(x, flat, there)
    x[ignored] = 1e3
    far = fit_noise(x, flat, scales, outliers=False, ignored=ignored)
    np.testing.assert_array_equal(log_densities(x, flat, far), known)
    assert np.count_nonzero(far.counted) == 400 - 2
