"""A measured force next to a law whose force fluctuates: what the law explains, and what the fluctuation."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from fluctuating_force import fluctuating_decay

SYSTEM = fb.Oscillator(mass=2.0, stiffness=200.0)
STEP, FRICTION, FORCE_SD, FORCE_NOISE = 0.01, 0.2, 0.06, 0.01


@pytest.fixture(scope="module")
def measured() -> dict[str, np.ndarray]:
    """Displacement, the friction that a load cell shows, and the part of it that fluctuates."""
    rng = np.random.default_rng(5)
    motion = fluctuating_decay(
        rng,
        frequency=SYSTEM.natural_frequency,
        friction=FRICTION / SYSTEM.stiffness,
        release=0.1,
        step=STEP,
        samples=1500,
        force_sd=FORCE_SD / SYSTEM.stiffness,
        correlation_time=0.1,
    )
    resisting = -(SYSTEM.moving * motion[2] + SYSTEM.stiffness * motion[0])
    return {
        "displacement": motion[0] + 2e-5 * rng.standard_normal(motion[0].size),
        "force": resisting + FORCE_NOISE * rng.standard_normal(motion[0].size),
        "fluctuation": FRICTION * np.sign(motion[1]) - resisting,
    }


@pytest.fixture(scope="module")
def report(measured: dict[str, np.ndarray]) -> fb.LoopReport:
    values = measured["displacement"]
    record = fb.make_record(STEP * np.arange(values.size), values, "displacement")
    return fb.close_loop(
        [record],
        SYSTEM,
        seed=1,
        effects=["viscous_damping", "cubic_stiffness", "random_force"],
        # a cell on the other side of the contact shows the opposite sign
        reference_force=-measured["force"],
    )


def test_the_fluctuation_is_the_one_that_acted(
    report: fb.LoopReport, measured: dict[str, np.ndarray]
) -> None:
    trace = report.traces[0].fluctuation
    assert trace is not None
    # at the release the mass is at rest, and friction has no direction
    found, sd, true = (x[1 : trace.force.size] for x in (trace.force, trace.sd, measured["fluctuation"]))
    # the smoother is as near to it as its bands say
    expected = np.sqrt(1.0 - np.mean(sd**2) / np.var(true))
    assert expected > 0.8
    assert np.corrcoef(found, true)[0, 1] == pytest.approx(expected, abs=0.05)
    z = (found - true) / sd
    assert 0.75 < np.sqrt(np.mean(z**2)) < 1.25
    assert 0.83 < np.mean(np.abs(z) < 1.645) < 0.97


def test_a_measured_force_is_explained_by_law_and_fluctuation(
    report: fb.LoopReport, measured: dict[str, np.ndarray]
) -> None:
    force = report.residual["force"]
    assert force["unit"] == "N"
    assert force["level"] == pytest.approx(FRICTION, rel=0.05)
    assert force["after"] < 0.7 * force["before"]
    assert force["before"] == pytest.approx(np.hypot(FORCE_SD, FORCE_NOISE), rel=0.5)
    law, both = force["explained_by_law"], force["explained_with_fluctuation"]
    assert law == pytest.approx(1.0 - (FORCE_SD**2 + FORCE_NOISE**2) / np.var(measured["force"]), abs=0.03)
    assert both > law + 0.04
    forces = report.traces[0].forces
    assert forces is not None
    assert both == pytest.approx(1.0 - np.mean((forces[0] - forces[2]) ** 2) / np.var(forces[0]))
