"""A sensor whose zero drifts along a line or a curve: that is found, taken out, and said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import friction_bayes as fb
from eighteen_half_cycles import AMPLITUDE, FRICTION, SYSTEM, UNIT, plain_estimate, record, width
from friction_bayes.estimators.noise.smooth_curve import smooth_curve


@pytest.mark.parametrize(
    ("drift", "quantity"),
    [(-0.1, "displacement"), (0.02, "displacement"), (-0.1, "velocity"), (0.02, "acceleration")],
)
def test_friction_is_known_as_well_as_without_a_drift(quantity: str, drift: float) -> None:
    """The bound with a line in place of a rest position is two per cent wider."""
    plain, drifts = plain_estimate(quantity), fb.estimate(record(quantity, drift=drift), SYSTEM)
    scale = AMPLITUDE * UNIT[quantity]
    assert drifts.decay.drift == pytest.approx(abs(drift) * scale, abs=0.003 * scale)
    assert drifts.friction.mean() == pytest.approx(plain.friction.mean(), abs=0.5 * plain.friction.std())
    assert width(drifts) < 1.05 * width(plain)
    assert drifts.frequency == pytest.approx(plain.frequency, rel=1e-3)
    assert any("the sensor's zero drifts by" in note for note in drifts.notes)


@pytest.mark.parametrize("quantity", list(UNIT))
def test_a_drift_that_hides_the_end_of_a_decay(quantity: str) -> None:
    """Some of the last half cycles are left out, in which the amplitude is less than the drift."""
    drifts = fb.estimate(record(quantity, drift=0.3), SYSTEM)
    low, high = drifts.friction.interval(0.9)
    assert low < FRICTION < high
    assert width(drifts) < 1.3 * width(plain_estimate(quantity))


def test_the_line_is_taken_out_about_the_middle_of_the_decay() -> None:
    drifts = fb.estimate(record(drift=0.1), SYSTEM)
    time = drifts.decay.time
    assert np.mean(smooth_curve(time, time[-1])[:, 0]) == pytest.approx(0.0, abs=1e-12)
    assert drifts.rest_position == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize(("quantity", "seed"), list(zip(UNIT, (1, 2, 3), strict=True)))
def test_a_zero_that_warms_up_is_taken_out(quantity: str, seed: int) -> None:
    plain = record(quantity, seed)
    course = 0.1 * AMPLITUDE * UNIT[quantity] * np.expm1(-np.linspace(0.0, 2.0, plain.size))
    drifts, known = (
        fb.estimate(plain.copy(data=plain.values + course), SYSTEM),
        plain_estimate(quantity, seed),
    )
    assert drifts.friction.mean() == pytest.approx(known.friction.mean(), abs=0.5 * known.friction.std())
    assert width(drifts) < 1.1 * width(known)
    assert drifts.decay.drift == pytest.approx(np.ptp(course), rel=0.1)


def test_a_spring_that_is_bent_is_no_drift() -> None:
    """By 1.5 % at the largest swing, as noise of a quarter of a per cent just shows; five of 16 had one."""
    system = fb.Oscillator(mass=1.0, stiffness=625.0)
    for seed in range(8):
        record = fb.simulate(
            system,
            friction=0.15,
            initial_displacement=0.01,
            duration=2.4,
            sampling_rate=1000.0,
            noise_sd=2.3e-5,
            seed=seed,
            effects={"cubic_stiffness.cubic_stiffness": 0.015 * 625.0 / 0.01**2},
        )
        # it is looked for in what a fit in white noise leaves
        assert fb.estimate(record, system, random_force="none").decay.drift == 0.0


def test_a_rest_position_that_is_known_does_not_drift() -> None:
    with_rest = fb.estimate(record(drift=0.02), SYSTEM, rest_position=0.0)
    assert with_rest.decay.drift == 0.0


@pytest.mark.parametrize("corner", [0.03, 0.06])
def test_what_an_ac_coupling_makes_of_a_displacement_is_no_drift(
    corner: float, rng: np.random.Generator
) -> None:
    """It takes a share of friction, which a drift does not."""
    plain = fb.simulate(
        SYSTEM, friction=FRICTION, initial_displacement=AMPLITUDE, duration=3.0, sampling_rate=200.0
    )
    kept = np.exp(-corner * SYSTEM.natural_frequency / 200.0)
    behind = 0.5 * (1.0 + kept) * lfilter([1.0, -1.0], [1.0, -kept], plain.values)
    found = fb.estimate(plain.copy(data=behind + 4e-6 * rng.standard_normal(plain.size)), SYSTEM)
    filter_ = found.to_dict()["noise"]["filter"]
    assert filter_ is not None
    assert filter_["name"].startswith("an AC coupling")
    assert found.decay.drift == 0.0
    assert found.friction.mean() == pytest.approx(FRICTION, rel=1e-3)
