"""Effects as columns along a path, where the path is far from what the record moves."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from decays import SYSTEM
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.loop.columns.effect_columns import ForceEvaluator, force_columns
from friction_bayes.loop.columns.law_columns import law_columns
from friction_bayes.mechanics.effects import EFFECTS, Scales
from friction_bayes.statespace.measured_path import MeasuredPath
from moving import moving_record


@pytest.mark.parametrize("swing", [1.0, 2.72])
def test_a_force_is_linear_in_its_size_however_fast_the_motion(swing: float) -> None:
    """At 27 Stribeck velocities the excess is so faint that rounding is as large as it is."""
    scales = Scales(
        system=SYSTEM, quantity=QUANTITIES["acceleration"], amplitude=0.01, duration=4.0, sampling_rate=500.0
    )
    phase = np.linspace(0.0, 40.0, 2000)
    path = MeasuredPath.through(phase, swing * 0.01 * np.cos(phase), -swing * 0.01 * np.sin(phase))
    evaluator = ForceEvaluator(10.0, 10.0, 1000.0, friction=1e-3, bent=1e-3, duration=4.0)
    columns = [column for column, _ in force_columns("stribeck_friction", scales, evaluator, path)]
    assert {column.kind for column in columns} == {"effect"}
    assert {column.parameter for column in columns} == {"static_excess"}
    assert all(column.of_friction for column in columns)


@pytest.mark.parametrize("name", ["stribeck_friction", "presliding"])
def test_a_shape_far_from_its_prior_is_a_number(name: str) -> None:
    """Data may lead there round by round; a probability next to one is rounded to one from 8.3 sd on."""
    scales = Scales(
        system=SYSTEM, quantity=QUANTITIES["displacement"], amplitude=0.01, duration=4.0, sampling_rate=500.0
    )
    phase = np.linspace(0.0, 40.0, 2000)
    path = MeasuredPath.through(phase, 0.01 * np.cos(phase), -0.01 * np.sin(phase))
    evaluator = ForceEvaluator(10.0, 10.0, 1000.0, friction=1e-3, bent=1e-3, duration=4.0)
    far = (8.0, 8.5, 9.0, 9.5, 10.0)
    found = list(force_columns(name, scales, evaluator, path, far))
    shapes = [column.shape[0] for column, _ in found if column.shape]
    assert all(column.weight > 0.0 for column, _ in found)
    assert all(np.isfinite([shape.low, shape.high]).all() for shape in shapes)
    assert all(shape.low < shape.high for shape in shapes)
    assert np.all(np.diff([shape.low for shape in shapes]) > 0.0)
    assert all(np.isfinite(each.force(path.nodes)).all() for each in found)


@pytest.mark.parametrize("name", ["encoder_eccentricity", "sensor_offset"])
def test_columns_are_linear_about_the_faults_of_the_law_before(name: str) -> None:
    """Of a swing that is a little larger, read by a sensor that is a little worse."""
    wheel, size = fb.Oscillator(inertia=0.1, stiffness=10.0), 0.05
    phase = np.linspace(0.0, 40.0, 400)
    scales = Scales(
        system=wheel, quantity=QUANTITIES["angle"], amplitude=0.8, duration=4.0, sampling_rate=100.0
    )
    record = moving_record(scales, name)
    path = MeasuredPath.through(phase, 0.8 * np.cos(phase), -0.8 * np.sin(phase))
    law = law_columns(path, record, w0=wheel.natural_frequency, friction=1e-3)
    sizes = np.zeros(len(law.columns))
    fault = law.alternatives(name)[0][0]
    sizes[fault] = size
    still = law.before(sizes, np.zeros(phase.size))
    about = law_columns(path, record, w0=wheel.natural_frequency, friction=1e-3, about=still)
    distort = EFFECTS[name].distort
    others = (0.0,) * (len(EFFECTS[name].parameters) - 1)
    off = []
    for change in (1e-2, 1e-3):
        sizes[0], sizes[fault] = 0.8 * (1.0 + change), size * (1.0 + change)
        shown = about.known + about.sensor @ sizes
        expected = distort(sizes[0] * np.cos(phase), phase, sizes[fault], *others)
        off.append(np.max(np.abs(shown - expected)))
    # what is left is of second order, and nothing where the fault does not follow the motion
    assert off[0] < 2e-4
    assert off[1] < 0.02 * off[0] + 1e-9


def test_a_drift_larger_than_the_swing_of_an_accelerometer_is_traced(seed: int) -> None:
    """Before any law is known it is a motion of fifteen times the swing."""
    record = fb.simulate(
        SYSTEM,
        friction=0.1,
        initial_displacement=0.01,
        duration=10.0,
        sampling_rate=200.0,
        quantity="acceleration",
        noise_sd=2e-3,
        seed=seed,
    )
    begun = record["time"].values > 0.2
    drift = 0.3 * record["time"].values / 10.0
    report = fb.close_loop([record.copy(data=record.values + drift)[begun]], SYSTEM, seed=1)
    assert [effect["name"] for effect in report.effects] == ["sensor_drift"]
    assert report.friction_after["mean"] == pytest.approx(0.1, abs=4.0 * report.friction_after["sd"])


@pytest.mark.parametrize("settles_in", [4.0, 8.0])
def test_a_zero_that_settles_leaves_a_plain_record(settles_in: float, seed: int) -> None:
    """Along a line it is not, and a random force that takes the rest makes the interval ten times as wide."""
    clean = fb.simulate(
        SYSTEM,
        friction=0.02,
        initial_displacement=0.01,
        duration=8.0,
        sampling_rate=100.0,
        noise_sd=1e-5,
        seed=seed,
    )
    warming = 4e-4 * np.exp(-clean["time"].values / settles_in)
    plain, warm = (
        fb.close_loop([record], SYSTEM) for record in (clean, clean.copy(data=clean.values + warming))
    )
    assert warm.verdict == "adequate"
    assert warm.candidates[0]["effects"] == ["curved_sensor_drift"]
    low, high = warm.friction_after["interval90"]
    assert high - low < 2.0 * float(np.ptp(plain.friction_after["interval90"]))
    assert warm.friction_after["mean"] == pytest.approx(0.02, abs=4.0 * warm.friction_after["sd"])


def test_a_zero_that_settles_at_once_does_not_take_the_place_of_a_knock(seed: int) -> None:
    """No cubic follows it: with one in the law the force was not searched for what else there is."""
    system = fb.Oscillator(mass=10.0, stiffness=1000.0)
    clean = fb.simulate(
        system,
        friction=0.07,
        initial_displacement=0.0147,
        duration=20.0,
        sampling_rate=50.0,
        noise_sd=2e-5,
        seed=seed,
    )
    settling = clean.copy(data=clean.values + 1e-3 * np.exp(-clean["time"].values))
    report = fb.close_loop([settling], system)
    assert report.verdict == "adequate"
    assert report.friction_after["sd"] < 3e-4
    assert report.friction_after["mean"] == pytest.approx(0.07, abs=4.0 * report.friction_after["sd"])
