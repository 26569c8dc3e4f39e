"""Release, stop, frequency, phase and rest position of a free decay, found in the data."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from friction_bayes import Estimate, InputError, Oscillator, Pendulum, estimate, make_record, simulate
from friction_bayes.decay.free_decay import FreeDecay, find_free_decay
from friction_bayes.decay.location import locate_free_decays
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.mechanics.coulomb import coulomb_decay

FREQUENCY = 2.0 * math.pi * 2.9
SYSTEM = Oscillator(mass=2.0, stiffness=2.0 * FREQUENCY**2)
QUANTITIES = ("displacement", "velocity", "acceleration")
AMPLITUDE = 0.015
HALF_CYCLES = 30.4


def decay_signal(
    quantity: str, rate: float, duration: float, *, phase: float = 0.0
) -> tuple[np.ndarray, float]:
    """Noise-free samples of a decay of 30.4 half cycles from a phase, and when it stops."""
    d = 0.5 * AMPLITUDE / HALF_CYCLES
    half = math.floor(phase / math.pi)
    swing = AMPLITUDE - (2 * half + 1) * d
    x, v = (-1) ** half * d + swing * math.cos(phase), -FREQUENCY * swing * math.sin(phase)
    time = np.arange(round(duration * rate)) / rate
    motion = coulomb_decay(SYSTEM, d * SYSTEM.stiffness, x, v, time)
    return (motion.displacement, motion.velocity, motion.acceleration)[
        QUANTITIES.index(quantity)
    ], motion.stop_time


def found(
    signal: np.ndarray, rate: float, quantity: str, system: Oscillator = SYSTEM, **given: float
) -> FreeDecay:
    return find_free_decay(make_record(np.arange(signal.size) / rate, signal, quantity), system, **given)


def noise(signal: np.ndarray, decibels: float, rng: np.random.Generator) -> np.ndarray:
    moving = signal[signal != signal[-1]]
    return np.sqrt(np.mean(moving**2)) * 10.0 ** (-decibels / 20.0) * rng.standard_normal(signal.size)


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize(
    ("rate", "decibels", "cycles"),
    [(1000.0, 300.0, 1.2), (1000.0, 12.0, 2.2), (100.0, 20.0, 2.2), (10.0, 30.0, 4.2)],
)
def test_mid_motion_offset_and_flat_tail(
    quantity: str, rate: float, decibels: float, cycles: float, rng: np.random.Generator
) -> None:
    signal, stop = decay_signal(quantity, rate, 8.0, phase=2.0)
    offset = np.abs(signal).max()
    declared = Oscillator(mass=2.0, stiffness=2.0 * (1.25 * FREQUENCY) ** 2)
    decay = found(signal + offset + noise(signal, decibels, rng), rate, quantity, declared)
    assert decay.start_time == 0.0
    assert decay.stops
    assert decay.values.size / rate == pytest.approx(stop, abs=cycles * math.pi / FREQUENCY)
    assert decay.frequency == pytest.approx(FREQUENCY, rel=0.02)
    assert math.remainder(decay.phase - 2.0, 2.0 * math.pi) == pytest.approx(0.0, abs=0.2)
    assert decay.rest_position == pytest.approx(offset, abs=0.05 * offset)


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("decibels", [12.0, 300.0])
@pytest.mark.parametrize("hold", [0.3, 4.0])
def test_hold_before_release(quantity: str, decibels: float, hold: float, rng: np.random.Generator) -> None:
    signal, _ = decay_signal(quantity, 1000.0, 8.0)
    held = signal[0] if quantity == "displacement" else 0.0
    record = np.concatenate([np.full(int(hold * 1000.0), held), signal]) + 0.01
    decay = found(record + noise(record - 0.01, decibels, rng), 1000.0, quantity)
    assert decay.start_time == pytest.approx(hold, abs=0.4 * math.pi / FREQUENCY)
    assert decay.stops


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_record_that_ends_in_motion_is_used_whole(quantity: str, rng: np.random.Generator) -> None:
    signal, _ = decay_signal(quantity, 200.0, 4.0, phase=5.0)
    decay = found(signal + noise(signal, 15.0, rng), 200.0, quantity)
    assert not decay.stops
    assert decay.values.size == signal.size


def test_quantised_to_rest() -> None:
    signal, stop = decay_signal("displacement", 1000.0, 20.0)
    decay = found(np.round(signal / 1e-4) * 1e-4, 1000.0, "displacement")
    assert decay.values.size / 1000.0 == pytest.approx(stop, abs=1.1 * math.pi / FREQUENCY)


def coarse_counts(rate: float, *, toggles: bool) -> tuple[np.ndarray, float]:
    """Counts of an encoder of steep last half cycles, which a straight amplitude outlasts, and the stop."""
    end = 16.0 * math.pi / FREQUENCY
    time = np.arange(round((end + 1.8 * math.pi / FREQUENCY) * rate)) / rate
    left = np.clip(1.0 - time / end, 0.0, None)
    counts = np.round(
        100.0 * left**0.6 * np.cos(FREQUENCY * time) + 10.0 * left * np.sin(0.3 * FREQUENCY * time)
    )
    at_rest = np.arange(time.size) // 3 % 2 if toggles else 0.0
    return np.where(time > end, at_rest, counts), end


@pytest.mark.parametrize("toggles", [False, True])
@pytest.mark.parametrize("rate", [80.0, 4000.0])
def test_counts_that_stand_still_are_no_motion(rate: float, toggles: bool) -> None:
    counts, end = coarse_counts(rate, toggles=toggles)
    decay = found(1.75e-2 * counts, rate, "displacement")
    assert decay.stops
    assert decay.values.size / rate == pytest.approx(end, abs=0.6 * math.pi / FREQUENCY)


def test_counts_that_stand_still_are_no_motion_where_the_loop_averages_them() -> None:
    counts, end = coarse_counts(4000.0, toggles=True)
    record = make_record(np.arange(counts.size) / 4000.0, 1.75e-2 * counts, "displacement")
    (segment,) = cut_records([record], SYSTEM)
    assert segment.block > 1
    assert segment.moving * segment.decay.step == pytest.approx(end, abs=0.6 * math.pi / FREQUENCY)


def test_a_swing_of_two_counts_goes_on() -> None:
    time = np.arange(4000) / 500.0
    counts = np.round(100.0 * np.exp(-0.5 * time) * np.cos(FREQUENCY * time))
    assert np.ptp(counts[-200:]) == 4.0
    decay = found(counts, 500.0, "displacement")
    assert not decay.stops
    assert decay.values.size == counts.size


def test_given_start_and_rest_position() -> None:
    signal, _ = decay_signal("displacement", 1000.0, 8.0)
    decay = found(signal, 1000.0, "displacement", start=0.5, rest_position=1e-3)
    assert decay.start_time == 0.5
    assert decay.rest_position == 1e-3
    assert decay.rest_known
    with pytest.raises(InputError, match=r"^start: 9 s lies outside .*; give 0 .. 7.999 s"):
        found(signal, 1000.0, "displacement", start=9.0)


def test_one_record_or_many_are_cut_alike(rng: np.random.Generator) -> None:
    signal, _ = decay_signal("displacement", 500.0, 8.0, phase=1.0)
    records = signal + noise(np.tile(signal, (5, 1)).ravel(), 15.0, rng)[: 5 * signal.size].reshape(5, -1)
    together = locate_free_decays(records, 1 / 500.0, FREQUENCY, 0)
    apart = [locate_free_decays(row[None], 1 / 500.0, FREQUENCY, 0) for row in records]
    for name, column in together._asdict().items():
        np.testing.assert_allclose(column, [getattr(one, name)[0] for one in apart], rtol=1e-12)


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        (np.full(4000, 0.3), "constant signal, 0.3 throughout"),
        (decay_signal("displacement", 1000.0, 0.4)[0], "fewer than three half cycles"),
        (
            np.where(np.arange(4000) == 7, np.nan, decay_signal("displacement", 1000.0, 4.0)[0]),
            "1 samples are not finite",
        ),
        (np.random.default_rng(1).standard_normal(4000), "no free oscillation found"),
        (np.arange(4000.0), "no free oscillation found"),
    ],
    ids=["constant", "short", "nan", "noise", "ramp"],
)
def test_refusals(signal: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        found(signal, 1000.0, "displacement")


@pytest.mark.parametrize("samples", [400, 4000], ids=["short", "noise"])
def test_a_refusal_says_which_frequency_is_declared_and_in_which_units(samples: int) -> None:
    signal = np.random.default_rng(1).standard_normal(4000)
    if samples == 400:
        signal = decay_signal("displacement", 1000.0, 0.4)[0]
    with pytest.raises(InputError, match=re.escape("the declared 2.9 Hz (SI units: kg, N/m)")):
        found(signal, 1000.0, "displacement")
    rotor = Oscillator(inertia=SYSTEM.mass, stiffness=SYSTEM.stiffness)
    with pytest.raises(InputError, match=re.escape("the declared 2.9 Hz (SI units: kg m2, N m/rad)")):
        found(signal, 1000.0, "angle", rotor)


def test_quantity_of_the_other_kind_of_system() -> None:
    with pytest.raises(InputError, match="angle does not belong to a linear motion"):
        found(decay_signal("displacement", 1000.0, 4.0)[0], 1000.0, "angle")


@pytest.mark.parametrize("late", [0.02, 0.045])
def test_the_clock_of_a_valid_record_is_taken_as_even(late: float) -> None:
    signal, _ = decay_signal("displacement", 200.0, 8.0)
    even = np.arange(signal.size) / 200.0
    jittered = even.copy()
    jittered[300] += late / 200.0
    from_even, from_jittered = (
        estimate(make_record(time, signal, "displacement"), SYSTEM, method="envelope")
        for time in (even, jittered)
    )
    assert from_jittered.friction.mean() == from_even.friction.mean()
    assert from_jittered.friction.std() == from_even.friction.std()


def test_the_samples_of_an_uneven_clock_keep_their_times(rng: np.random.Generator) -> None:
    fine, stop = decay_signal("displacement", 2000.0, 8.0)
    # held for a fifth of a second, then free; a sample at any time of the first two thirds of each interval
    held = np.concatenate([np.full(400, fine[0]), fine])
    kept = 30 * np.arange(held.size // 30) + rng.integers(0, 20, held.size // 30)
    record = make_record(kept / 2000.0, held[kept], "displacement")
    decay = find_free_decay(record, SYSTEM)
    assert not decay.evenly_spaced
    first = int(np.searchsorted(record["time"].values, decay.start_time))
    recorded = record.isel(time=slice(first, first + decay.values.size))
    np.testing.assert_array_equal(decay.values, recorded.values)
    np.testing.assert_allclose(decay.start_time + decay.time, recorded["time"].values, atol=1e-12)
    period = 2.0 * math.pi / FREQUENCY
    assert decay.start_time == pytest.approx(0.2, abs=0.1 * period)
    assert decay.start_time + decay.duration == pytest.approx(0.2 + stop, abs=0.6 * period)
    assert decay.frequency == pytest.approx(FREQUENCY, rel=5e-3)
    due = FREQUENCY * (decay.start_time - 0.2)
    assert math.cos(decay.phase - due) > math.cos(0.2)
    even = decay.on_even_grid()
    assert even.evenly_spaced
    assert even.duration == pytest.approx(decay.duration, rel=1e-9)


@pytest.mark.parametrize("hold", [1.1, 1.3, 5.0])
def test_a_hold_before_the_release_is_no_other_mode(hold: float, rng: np.random.Generator) -> None:
    """Held for so many periods."""
    signal, _ = decay_signal("displacement", 200.0, 6.0)
    held = np.concatenate([np.full(round(hold * 200.0 * 2.0 * math.pi / FREQUENCY), signal[0]), signal])
    decay = found(held + noise(held, 40.0, rng), 200.0, "displacement")
    assert math.isnan(decay.other_share)


@pytest.mark.parametrize(
    ("mass", "mass_sd", "said"),
    [
        (8.0, 0.0, "a signal without a sign"),
        (0.5, 0.0, "from half periods"),
        (2.9, 0.0, "no damping shifts it as far, check mass, stiffness and their units (kg, N/m)"),
        (2.9, 0.5, ""),
        (2.3, 0.0, ""),
        (2.0, 0.0, ""),
    ],
)
def test_a_frequency_far_from_the_declared_one_is_said_with_its_likely_cause(
    mass: float, mass_sd: float, said: str
) -> None:
    signal, _ = decay_signal("displacement", 200.0, 8.0)
    declared = Oscillator(mass=mass, stiffness=SYSTEM.stiffness, mass_sd=mass_sd)
    decay = found(signal, 200.0, "displacement", declared)
    reported = decay.far_from_declared(decay.frequency)
    assert said in reported
    assert bool(reported) == bool(said)
    assert decay.both_frequencies(2.0 * math.pi).startswith("swings at 1 Hz, declared mass and stiffness")


@pytest.mark.parametrize(
    ("declared", "word"), [(12.5 / 4.0, "twice as fast"), (12.5, ""), (50.0, "twice the frequency")]
)
def test_a_far_swing_hides_no_wrong_multiple_of_the_frequency(declared: float, word: str) -> None:
    pendulum = Pendulum(inertia=0.5, stiffness=12.5)
    record = simulate(
        pendulum,
        friction=0.15,
        initial_displacement=1.5,
        duration=25.0,
        sampling_rate=50.0,
        quantity="angle",
        noise_sd=0.01,
        seed=1,
    )
    decay = find_free_decay(record, Pendulum(inertia=0.5, stiffness=declared))
    reported = decay.far_from_declared(decay.frequency)
    assert word in reported
    assert bool(reported) == bool(word)


RATE = 200.0


def with_lost(*lost: slice) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a decay of 69 samples a period that lacks some of them."""
    values, _ = decay_signal("displacement", RATE, 4.0)
    values += 1e-4 * np.random.default_rng(1).normal(size=values.size)
    kept = np.ones(values.size, dtype=bool)
    for each in lost:
        kept[each] = False
    return np.arange(values.size)[kept] / RATE, values[kept]


@pytest.fixture(scope="module")
def whole() -> Estimate:
    return estimate(make_record(*with_lost(), "displacement"), SYSTEM, random_force="none")


@pytest.mark.parametrize(
    ("first", "length", "rel"),
    [
        *((first, 16, 0.1) for first in (3, 100, 117, 400, 597)),
        *((k, 67, 0.3) for k in (3, 100, 117, 400, 550)),
    ],
)
def test_a_gap_of_less_than_a_period_costs_what_it_would_have_shown(
    first: int, length: int, rel: float, whole: Estimate
) -> None:
    """Of 69 samples a period: a whole one is a tenth of all. With a force see ``test_lost_samples.py``."""
    record = make_record(*with_lost(slice(first, first + length)), "displacement")
    lacking = estimate(record, SYSTEM, random_force="none")
    assert lacking.friction.mean() == pytest.approx(whole.friction.mean(), abs=whole.friction.std())
    assert lacking.friction.std() == pytest.approx(whole.friction.std(), rel=rel)


def test_a_longer_gap_is_refused_and_named() -> None:
    record = make_record(*with_lost(slice(100, 169)), "displacement", name="swing.csv")
    with pytest.raises(
        InputError,
        match=r"^swing.csv: gap of 0.35 s after sample 100 \(t = 0.495 s\): 1.01 periods .* typical "
        r"interval is 0.005 s; take the part before it, end=0.495, or after it, start=0.845; ",
    ):
        estimate(record, SYSTEM)


def test_two_samples_may_be_lost_anywhere_however_few_a_period_has() -> None:
    values, _ = decay_signal("displacement", 20.0, 4.0)
    time = np.arange(values.size) / 20.0
    for first in range(1, values.size - 2):
        kept = np.delete(np.arange(values.size), [first, first + 1])
        assert find_free_decay(make_record(time[kept], values[kept], "displacement"), SYSTEM).values.size > 50
    lost_six = np.delete(np.arange(values.size), range(30, 36))
    with pytest.raises(InputError, match=r"gap of 0\.35 s"):
        find_free_decay(make_record(time[lost_six], values[lost_six], "displacement"), SYSTEM)


def test_a_motion_of_three_half_cycles_before_a_long_rest_is_refused() -> None:
    """Pulled from rest within six samples; the phase that bends to the rest runs backwards at the start."""
    swing = [3.6, 7.1, 11.1, 14.8, 17.4, 19.1, 16.4, 12.2, 7.0, 1.4, -4.1, -8.7, -12.1, -13.8, -13.8, -12.5]
    swing += [-10.2, -7.1, -3.5, 0.1, 3.4, 6.0, 7.6, 8.0, 7.6, 6.8, 5.5, 3.9, 2.3, 0.7, -0.6, -1.6]
    signal = 1e-3 * np.concatenate([np.zeros(15), swing, np.full(152, -2.0)])
    with pytest.raises(InputError, match="no free oscillation found"):
        found(signal, 30.0, "displacement", Oscillator(mass=10.0, stiffness=1000.0))
