"""A signal in volts: every part of the report gives friction in volts, and no sine is taken of it."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from decays import long_decay, written_decay
from friction_bayes.loop import close_loop

FRICTION, STIFFNESS, GAIN = 0.5, 1000.0, 40.0


@pytest.mark.parametrize("kind", [fb.Oscillator, fb.Pendulum])
def test_friction_in_the_unit_of_the_signal(kind: type[fb.Oscillator], rng: np.random.Generator) -> None:
    shift = FRICTION / STIFFNESS
    time = np.arange(500) / 100.0
    volts = GAIN * (written_decay(time, 0.02, shift) + rng.normal(0.0, 1e-5, time.size))
    record = fb.make_record(time, volts, "angle", unit="V", name="volts")
    system = kind(inertia=10.0, stiffness=STIFFNESS)
    report = close_loop([record], system, seed=1, effects=("cubic_stiffness",))
    assert report.candidates[0]["effects"] == []
    for friction in (report.friction_before, report.friction_after, report.paper_procedure["friction"]):
        assert friction["unit"] == "V"
        assert friction["mean"] == pytest.approx(GAIN * shift, rel=0.05)
    assert report.frequency["mean"] == pytest.approx(10.0, rel=1e-3)
    assert report.frequency["from_mass"] is None
    # 6 sd: a false alarm in 1e8
    assert abs(report.friction_after["mean"] - GAIN * shift) < 6.0 * report.friction_after["sd"]


def test_parameters_of_forces_say_what_a_volt_was_taken_for() -> None:
    bent = {"cubic_stiffness.cubic_stiffness": 8e4, "viscous_damping.damping_ratio": 0.004}
    calibrated = long_decay(effects=bent, seed=1)
    volts = fb.make_record(calibrated["time"].values, GAIN * calibrated.values, "displacement", unit="V")
    system = fb.Oscillator(mass=10.0, stiffness=STIFFNESS)
    report = close_loop([volts], system, seed=1, effects=tuple(name.partition(".")[0] for name in bent))
    found = {effect["name"]: effect["parameters"] for effect in report.effects}
    stiffness = found["cubic_stiffness"]["cubic_stiffness"]
    assert stiffness["unit"] == "N/m3 (1 V as 1 m)"
    assert stiffness["mean"] * GAIN**2 == pytest.approx(8e4, rel=0.1)
    assert found["viscous_damping"]["damping_ratio"]["unit"] == "1"
