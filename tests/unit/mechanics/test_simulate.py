"""Synthetic records: motion, noise, sensor and digitiser."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from numba import njit

from friction_bayes.core.errors import InputError
from friction_bayes.core.system import Oscillator, Pendulum
from friction_bayes.mechanics.coulomb import coulomb_decay
from friction_bayes.mechanics.effects import (
    EFFECTS,
    ForceEffect,
    Parameter,
    SensorEffect,
    register,
)
from friction_bayes.mechanics.effects.prior import half_normal
from friction_bayes.mechanics.integrate import integrate
from friction_bayes.mechanics.simulate import noise_sd_for, signal_to_noise_db, simulate

SYSTEM = Oscillator(mass=2.0, stiffness=800.0)
COMMON = {"friction": 0.5, "initial_displacement": 0.02, "duration": 4.0, "sampling_rate": 500.0}


@pytest.mark.parametrize(("quantity", "order"), [(None, 0), ("velocity", 1), ("acceleration", 2)])
def test_a_clean_record_is_the_exact_motion(quantity, order):
    record = simulate(SYSTEM, **COMMON, initial_velocity=0.3, quantity=quantity)
    motion = coulomb_decay(SYSTEM, 0.5, 0.02, 0.3, np.arange(2_000) / 500.0)
    np.testing.assert_array_equal(record.values, motion.derivative(order))
    np.testing.assert_array_equal(record["time"].values, motion.time)
    assert record.attrs["synthetic"] is True
    assert record.attrs["quantity"] == (quantity or "displacement")


def test_backlash_waits_after_each_turning_point_until_its_play_is_taken_up():
    lag = 1.5e-3
    backlash = {"sensor_hysteresis.half_width": lag, "sensor_hysteresis.play": 2.0 * lag}
    x = simulate(SYSTEM, **COMMON).values
    shown = simulate(SYSTEM, **COMMON, effects=backlash).values
    behind, moved = x - shown, np.diff(shown)
    assert np.abs(behind).max() <= lag * (1.0 + 1e-12)
    # between the ends of the play the reading is still, at them it follows the motion
    between = np.abs(behind[1:]) < lag * (1.0 - 1e-9)
    assert 0.05 < between.mean() < 0.95
    assert np.abs(moved[between & np.roll(between, 1)][1:]).max() < 1e-15
    assert (moved * np.diff(x) >= -1e-18).all()


def test_force_effects_and_pendulums_are_integrated():
    effects = {"friction_drift.relative_change": 0.5}
    record = simulate(SYSTEM, **COMMON, effects=effects)
    motion = integrate(SYSTEM, 0.5, 0.02, 0.0, record["time"].values, effects, duration=4.0)
    np.testing.assert_array_equal(record.values, motion.displacement)
    swing = simulate(
        Pendulum(inertia=1.0, stiffness=10.0),
        friction=0.05,
        initial_displacement=2.5,
        duration=5.0,
        sampling_rate=100.0,
    )
    assert swing.attrs["quantity"] == "angle"
    # at 2.5 rad a pendulum takes far longer than 2 pi / w0 to come back
    assert swing.values[int(100 * 2 * math.pi / math.sqrt(10.0))] < 0.0


def test_the_record_says_how_it_was_made():
    record = simulate(
        SYSTEM,
        **COMMON,
        noise_sd=1e-4,
        seed=7,
        effects={"sensor_offset.offset": 1e-3},
        bits=16,
        sensor_range=0.05,
    )
    attrs = record.attrs
    expected = COMMON | {"mass": 2.0, "stiffness": 800.0, "noise_sd": 1e-4, "seed": 7, "bits": 16}
    assert {key: attrs[key] for key in expected} == expected
    assert attrs["sensor_range"] == 0.05
    assert json.loads(attrs["effects"]) == {"sensor_offset.offset": 1e-3}
    exact = coulomb_decay(SYSTEM, 0.5, 0.02, 0.0, record["time"].values)
    assert attrs["stop_time"] == exact.stop_time
    assert attrs["signal_to_noise_db"] == signal_to_noise_db(exact.displacement[exact.moving], 1e-4)


def test_noise_is_seeded_and_has_its_standard_deviation():
    clean = simulate(SYSTEM, **COMMON)
    noisy, again, other = (simulate(SYSTEM, **COMMON, noise_sd=1e-3, seed=seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(noisy.values, again.values)
    assert np.any(noisy.values != other.values)
    noise = noisy.values - clean.values
    # five standard errors of the sample standard deviation and mean of 2000 samples
    assert abs(noise.std() / 1e-3 - 1.0) < 5.0 / math.sqrt(2.0 * noise.size)
    assert abs(noise.mean()) < 5.0 * 1e-3 / math.sqrt(noise.size)


def test_outliers_replace_a_fraction_of_the_noise():
    effects = {"outliers.fraction": 0.1, "outliers.scale": 1.0}
    noise = (
        simulate(SYSTEM, **COMMON, noise_sd=1e-6, seed=3, effects=effects).values
        - simulate(SYSTEM, **COMMON).values
    )
    share = np.mean(np.abs(noise) > 1e-4)
    assert abs(share - 0.1) < 5.0 * math.sqrt(0.1 * 0.9 / noise.size)


def test_clipping_acts_on_the_noisy_signal_and_offset_before_it():
    effects = {"sensor_clipping.level": 0.015, "sensor_offset.offset": 0.01}
    record = simulate(SYSTEM, **COMMON, noise_sd=1e-3, seed=3, effects=effects)
    top = record.values == 0.015
    assert top.sum() > 100
    assert record.values.max() == 0.015
    assert record.values.min() > -0.015


def test_sixteen_bits_over_the_range():
    record = simulate(SYSTEM, **COMMON, bits=16, sensor_range=0.01)
    clean = simulate(SYSTEM, **COMMON)
    step = 0.01 / 2**15
    codes = record.values / step
    np.testing.assert_allclose(codes, np.rint(codes), atol=1e-6)
    assert record.values.max() == pytest.approx(0.01 - step)
    assert record.values.min() == -0.01
    inside = np.abs(clean.values) < 0.0099
    assert np.max(np.abs(record.values - clean.values)[inside]) <= 0.5 * step * (1 + 1e-9)
    analogue = simulate(SYSTEM, **COMMON, sensor_range=0.01)
    np.testing.assert_array_equal(analogue.values, np.clip(clean.values, -0.01, 0.01))


def test_signal_to_noise_ratio_and_its_inverse():
    signal = np.sin(np.linspace(0.0, 40.0 * math.pi, 4_000, endpoint=False))
    assert signal_to_noise_db(signal, 0.1) == pytest.approx(10.0 * math.log10(0.5 / 0.01))
    assert signal_to_noise_db(signal, noise_sd_for(signal, 14.7)) == pytest.approx(14.7)
    with pytest.raises(InputError, match="does not move"):
        signal_to_noise_db(np.zeros(5), 0.1)


def test_effects_registered_from_outside_are_simulated(monkeypatch):
    zeta = 0.03
    theirs = simulate(SYSTEM, **COMMON, effects={"viscous_damping.damping_ratio": zeta})
    # next to one effect of the catalogue: with all of them the integrator takes long to compile
    some = {"viscous_damping": EFFECTS["viscous_damping"]}
    monkeypatch.setattr("friction_bayes.mechanics.effects.registry.EFFECTS", some)

    @njit
    def damping(t, x, v, direction, friction, duration, mass, stiffness, p, i):
        return p[i] * v

    coefficient = Parameter(name="coefficient", unit="N s/m", low=0.0, prior=lambda scales: half_normal(1.0))
    register(ForceEffect(name="dashpot", summary="c v", parameters=(coefficient,), force=damping))
    gain = Parameter(name="error", unit="1", prior=lambda scales: half_normal(0.1))
    register(
        SensorEffect(
            name="gain", summary="(1 + e) y", parameters=(gain,), distort=lambda y, time, e: (1.0 + e) * y
        )
    )
    dashpot = 2.0 * zeta * math.sqrt(SYSTEM.stiffness * SYSTEM.moving)
    mine = simulate(SYSTEM, **COMMON, effects={"dashpot.coefficient": dashpot, "gain.error": 0.5})
    np.testing.assert_allclose(mine.values, 1.5 * theirs.values, atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "place"),
    [
        ({"friction": -0.5}, "friction"),
        ({"duration": 0.0}, "duration"),
        ({"duration": 1e-6}, "duration"),
        ({"duration": 1e9}, "duration"),
        ({"sampling_rate": math.inf}, "sampling_rate"),
        ({"noise_sd": -1.0}, "noise_sd"),
        ({"noise_sd": 1e-3}, "seed"),
        ({"effects": {"outliers.fraction": 0.1, "outliers.scale": 1.0}}, "seed"),
        ({"quantity": "angle"}, "quantity"),
        ({"quantity": "speed"}, "quantity"),
        ({"bits": 16}, "bits"),
        ({"bits": 0, "sensor_range": 1.0}, "bits"),
        ({"sensor_range": 0.0}, "sensor_range"),
        ({"effects": {"magic.power": 1.0}}, "effects"),
    ],
)
def test_bad_input_is_refused_by_name(arguments, place):
    with pytest.raises(InputError) as caught:
        simulate(SYSTEM, **(COMMON | arguments))
    assert caught.value.place == place
