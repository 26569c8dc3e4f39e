"""What every free decay obeys, whatever the system and the start."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from friction_bayes.core.system import Oscillator
from friction_bayes.mechanics.coulomb import coulomb_decay
from friction_bayes.mechanics.integrate import integrate

systems = st.builds(
    lambda mass, frequency: Oscillator(mass=mass, stiffness=mass * (2.0 * math.pi * frequency) ** 2),
    mass=st.floats(1e-3, 1e3),
    frequency=st.floats(0.1, 100.0),
)
amplitudes = st.floats(1e-6, 10.0)
phases = st.floats(0.0, 2.0 * math.pi)
half_cycles = st.floats(0.1, 60.0)
dissipation = st.dictionaries(
    st.sampled_from(["viscous_damping.damping_ratio", "friction_drift.relative_change"]), st.floats(0.0, 0.1)
)


def start(system, amplitude, phase, half_cycles):
    """State of amplitude and phase, and the friction that stops it after so many half cycles or so."""
    friction = system.stiffness * amplitude / (2.0 * half_cycles)
    return friction, amplitude * math.cos(phase), -amplitude * system.natural_frequency * math.sin(phase)


@given(systems, amplitudes, phases, half_cycles, st.floats(0.0, 1.2))
def test_restarted_from_any_state_the_future_is_the_same(system, amplitude, phase, count, share):
    friction, x0, v0 = start(system, amplitude, phase, count)
    period = 2.0 * math.pi / system.natural_frequency
    time = np.linspace(0.0, 0.5 * (count + 3.0) * period, 200)
    whole = coulomb_decay(system, friction, x0, v0, time)
    cut = min(int(share * time.size), time.size - 1)
    # within rounding of a turning point the restart may take the other side of the acceleration jump
    near = np.min(np.abs(time[cut] - whole.turning_times), initial=math.inf)
    assume(near > 1e-6 * period or whole.velocity[cut] == 0.0)
    again = coulomb_decay(system, friction, whole.displacement[cut], whole.velocity[cut], time[cut:])
    scale = amplitude + friction / system.stiffness
    np.testing.assert_allclose(again.displacement, whole.displacement[cut:], atol=1e-9 * scale, rtol=0.0)
    np.testing.assert_allclose(
        again.velocity, whole.velocity[cut:], atol=1e-9 * scale * system.natural_frequency, rtol=0.0
    )


@given(systems, amplitudes, phases, half_cycles)
def test_motion_is_odd_and_shifts_in_time(system, amplitude, phase, count):
    friction, x0, v0 = start(system, amplitude, phase, count)
    time = np.linspace(0.0, (count + 2.0) * math.pi / system.natural_frequency, 100)
    motion = coulomb_decay(system, friction, x0, v0, time)
    mirrored = coulomb_decay(system, friction, -x0, -v0, time)
    np.testing.assert_array_equal(mirrored.displacement, -motion.displacement)
    np.testing.assert_array_equal(mirrored.acceleration, -motion.acceleration)
    later = coulomb_decay(system, friction, x0, v0, time + 2.0)
    np.testing.assert_allclose(later.displacement, motion.displacement, atol=1e-9 * amplitude, rtol=0.0)


@given(systems, amplitudes, phases, half_cycles)
def test_it_stops_inside_the_band_and_never_before(system, amplitude, phase, count):
    friction, x0, v0 = start(system, amplitude, phase, count)
    time = np.linspace(0.0, (count + 3.0) * math.pi / system.natural_frequency, 50)
    motion = coulomb_decay(system, friction, x0, v0, time)
    deadband = friction / system.stiffness * (1.0 + 1e-9)
    assert math.isfinite(motion.stop_time)
    assert abs(motion.turning_points[-1]) <= deadband
    assert np.all(np.abs(motion.turning_points[:-1]) > friction / system.stiffness * (1.0 - 1e-9))
    swings = np.abs(np.diff(motion.turning_points))
    np.testing.assert_allclose(np.diff(swings), -4.0 * friction / system.stiffness, rtol=1e-6)


@given(systems, amplitudes, phases, half_cycles)
def test_the_integrator_is_the_exact_solution(system, amplitude, phase, count):
    friction, x0, v0 = start(system, amplitude, phase, count)
    time = np.linspace(0.0, (count + 3.0) * math.pi / system.natural_frequency, 150)
    exact = coulomb_decay(system, friction, x0, v0, time)
    # on the edge of the band rounding decides whether it sticks
    margin = np.abs(np.abs(exact.turning_points) * system.stiffness / friction - 1.0)
    assume(np.all(margin > 1e-6))
    motion = integrate(system, friction, x0, v0, time)
    np.testing.assert_allclose(motion.displacement, exact.displacement, atol=1e-9 * amplitude, rtol=0.0)
    assert motion.turning_points.size == exact.turning_points.size
    assert motion.stop_time == pytest.approx(exact.stop_time, rel=1e-7)


@given(systems, amplitudes, phases, half_cycles, dissipation, st.floats(0.05, 0.95))
def test_the_output_times_do_not_matter(system, amplitude, phase, count, effects, share):
    friction, x0, v0 = start(system, amplitude, phase, count)
    end = (count + 3.0) * math.pi / system.natural_frequency
    coarse = integrate(system, friction, x0, v0, [0.0, share * end, end], effects, duration=end)
    fine = integrate(
        system, friction, x0, v0, np.union1d(np.linspace(0.0, end, 300), share * end), effects, duration=end
    )
    at = np.searchsorted(fine.time, share * end)
    assert abs(coarse.displacement[1] - fine.displacement[at]) < 1e-9 * amplitude
    assert abs(coarse.displacement[-1] - fine.displacement[-1]) < 1e-9 * amplitude
