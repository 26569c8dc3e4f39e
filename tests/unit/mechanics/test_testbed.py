"""The paper's two set-ups: its numerical example, and the twin of its testbed with its sensors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from experiments.paper_numbers import printed
from experiments.rig import Rig, run_rig, system_of
from friction_bayes.core.quantities import STANDARD_GRAVITY
from friction_bayes.mechanics.coulomb import coulomb_decay
from friction_bayes.mechanics.testbed import (
    PAPER_FRICTION,
    PAPER_SYSTEM,
    TESTBED,
    TESTBED_FREQUENCY,
    TESTBED_FRICTION,
    TESTBED_SPAN,
    paper_example,
)


def test_settings_are_those_the_paper_prints():
    assert printed("example-friction") == PAPER_FRICTION
    assert (printed("example-mass"), printed("example-stiffness")) == (10.0, 1000.0)
    assert (PAPER_SYSTEM.mass, PAPER_SYSTEM.stiffness) == (10.0, 1000.0)
    assert printed("rig-frequency") == TESTBED_FREQUENCY
    assert printed("reference-1") == TESTBED_FRICTION
    rig = Rig()
    assert (rig.bits, rig.sampling_rate) == (printed("rig-bits"), printed("rig-sampling-rate"))
    assert rig.accelerometer_noise == printed("rig-accelerometer-noise")
    assert rig.accelerometer_range == printed("rig-accelerometer-range")
    span = printed("rig-displacement-high") - printed("rig-displacement-low")
    assert pytest.approx(1e-3 * span) == TESTBED_SPAN == rig.displacement_range


def test_the_paper_example_has_its_peaks_and_decibels():
    record = paper_example(1)
    motion = coulomb_decay(
        PAPER_SYSTEM, 0.07, record.attrs["initial_displacement"], 0.0, record["time"].values
    )
    positive = motion.turning_points[motion.turning_points > 0.0]
    assert positive.size >= 51
    assert record.size == 33_000
    assert record.attrs["signal_to_noise_db"] == pytest.approx(21.6, abs=0.05)


def test_the_testbed_twin_is_the_rig_of_section_4():
    rig = Rig(roughness=0.0, burst_sizes=(0.0, 0.0, 0.0))
    record = run_rig(rig, TESTBED_FRICTION, seed=2)["acceleration"]
    assert TESTBED.natural_frequency / (2.0 * math.pi) == pytest.approx(2.9)
    assert system_of(rig) == TESTBED
    assert record.attrs["quantity"] == "acceleration"
    assert record.attrs["friction"] == 0.2933
    at_rest = record.values[record["time"].values > record.attrs["stop_time"] + 0.1]
    # five standard errors of a standard deviation
    noise = 6.2e-3 * STANDARD_GRAVITY
    assert at_rest.std() == pytest.approx(noise, rel=5.0 / math.sqrt(2.0 * at_rest.size))
    step = 2.0 * STANDARD_GRAVITY / 2**15
    np.testing.assert_allclose(record.values / step, np.rint(record.values / step), atol=1e-6)
    assert np.max(np.abs(record.values)) < 2.0 * STANDARD_GRAVITY
    for friction, periods in ((0.2933, 21), (0.1834, 34)):
        stop = run_rig(rig, friction, seed=2)["acceleration"].attrs["stop_time"]
        assert round(2.9 * stop) == periods
