"""Filters between motion and recording: their responses, and what is found of them and put back."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy import ndimage, signal

import friction_bayes as fb
from filtered_decays import filtered, settled
from fluctuating_force import fluctuating_decay
from friction_bayes.estimators.noise.recording_filters import (
    RecordingFilter,
    Through,
    blended,
    kinds_for,
    margin,
)

Process = Callable[[np.ndarray], np.ndarray]

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)
RATE = 100.0
ANGLE = 10.0 / RATE


KINDS = kinds_for(ANGLE, 2)
DIFFERENCES, DIFFERENCES_TWICE, SLOPES, SLOPES_TWICE = KINDS[-4:]
MEAN, MEAN_TWICE, HANN, QUADRATIC, _, COUPLING, SMOOTHING, GAUSSIAN, *LOW_PASSES = KINDS[:20]
BESSEL, MOUNTED = KINDS[20:22]
(PICKED_UP, *_) = (kind for kind in kinds_for(ANGLE, 1) if kind.name.startswith("high pass of order 2"))
DECIMATIONS = [kind for kind in KINDS if kind.name.startswith("decimation")]
ORDERS = (1, 2, 3, 4, 6, 8)
ONE_WAY = dict(zip(ORDERS, LOW_PASSES[:6], strict=True))
BOTH_WAYS = dict(zip(ORDERS, LOW_PASSES[6:], strict=True))
"""Low passes by their order."""
CORNER = 8.0 * ANGLE
OMEGA = np.linspace(0.01, 3.1, 50)


@pytest.mark.parametrize("order", ORDERS)
def test_a_low_pass_is_scipys(order: int) -> None:
    expected = signal.freqz_sos(signal.butter(order, CORNER / math.pi, output="sos"), OMEGA)[1]
    np.testing.assert_allclose(ONE_WAY[order].of(CORNER).response(OMEGA), expected, rtol=1e-9)
    both = BOTH_WAYS[order].of(CORNER).response(OMEGA)
    np.testing.assert_allclose(both, np.abs(expected) ** 2, rtol=1e-9)


def test_a_bessel_filter_is_scipys() -> None:
    b, a = signal.bessel(4, CORNER / math.pi, norm="mag")
    expected = signal.freqz(b, a, OMEGA)[1]
    np.testing.assert_allclose(BESSEL.of(CORNER).response(OMEGA), expected, rtol=1e-9)


def test_oscillators_between_motion_and_recording_are_those_of_scipy() -> None:
    """The mount by the bilinear transform with its corner kept, to half the motion's gain; the pickup."""
    warped = 2.0 * math.tan(0.5 * CORNER)
    b, a = signal.bilinear([warped**2], [1.0, 2.0 * 0.02 * warped, warped**2])
    expected, (at_motion,) = (signal.freqz(b, a, omega)[1] for omega in (OMEGA, [ANGLE]))
    expected *= 0.5 + 0.5 / abs(at_motion)
    np.testing.assert_allclose(MOUNTED.of(CORNER).response(OMEGA), expected, rtol=1e-9)
    low = 0.4 * ANGLE
    expected = signal.freqs([1.0, 0.0, 0.0], [1.0, 2.0 * 0.57 * low, low**2], OMEGA)[1]
    np.testing.assert_allclose(PICKED_UP.of(low).response(OMEGA), expected, rtol=1e-9)


def test_exponential_smoothing_is_its_recursion() -> None:
    share = -math.expm1(-CORNER)
    expected = signal.freqz([share], [1.0, share - 1.0], OMEGA)[1]
    np.testing.assert_allclose(SMOOTHING.of(CORNER).response(OMEGA), expected, rtol=1e-9)


def test_gaussian_weights_are_those_of_scipy() -> None:
    impulse = np.zeros(201)
    impulse[100] = 1.0
    weights = ndimage.gaussian_filter1d(impulse, math.sqrt(math.log(2.0)) / CORNER, truncate=12.0)
    expected = np.cos(np.multiply.outer(OMEGA, np.arange(-100, 101))) @ weights
    np.testing.assert_allclose(GAUSSIAN.of(CORNER).response(OMEGA), expected, atol=1e-9)


def test_windows_are_those_of_convolution() -> None:
    wave = np.cos(ANGLE * np.arange(2000))
    mean, twice = MEAN.of(21.0), MEAN_TWICE.of(21.0)
    hann, fitted = HANN.of(21.0), QUADRATIC.of(21.0)
    bell = signal.windows.hann(23)[1:-1]
    at = slice(500, 1500)
    averaged = np.convolve(wave, np.ones(21) / 21.0, mode="same")
    for filter_, expected in (
        (mean, averaged),
        (twice, np.convolve(averaged, np.ones(21) / 21.0, mode="same")),
        (hann, np.convolve(wave, bell / bell.sum(), mode="same")),
        (fitted, signal.savgol_filter(wave, 21, 3)),
    ):
        np.testing.assert_allclose(Through(wave[:, None])(filter_)[at, 0], expected[at], atol=1e-9)
        np.testing.assert_allclose(expected[at], filter_.gain * wave[at], atol=1e-9)


@pytest.mark.parametrize("ways", [1, 2])
@pytest.mark.parametrize("factor", [2, 5])
def test_decimation_is_scipys(factor: int, ways: int) -> None:
    sections = signal.cheby1(8, 0.05, 0.8 / factor, output="sos")
    expected = signal.freqz_sos(sections, OMEGA / factor)[1]
    expected = np.abs(expected) ** 2 if ways == 2 else expected
    np.testing.assert_allclose(DECIMATIONS[ways - 1].of(factor).response(OMEGA), expected, rtol=1e-9)


@pytest.mark.parametrize("ways", [1, 2])
def test_noise_behind_decimation_is_that_of_decimated_noise(ways: int, rng: np.random.Generator) -> None:
    """By Welch's estimates of 700 stretches: an sd of some 4 %, and leaks where the density is steep."""
    noise = signal.decimate(rng.standard_normal(300_000), 3, zero_phase=ways == 2)
    frequency, density = signal.welch(noise, fs=2.0 * math.pi, nperseg=256)
    expected = DECIMATIONS[ways - 1].of(3.0).power_of_noise(frequency)
    # of one side, but for both ends
    np.testing.assert_allclose(3.0 * math.pi * density[2:-1], expected[2:-1], rtol=0.2, atol=0.02)


def twice(weights: Sequence[float]) -> Any:
    return np.convolve(weights, weights)


@pytest.mark.parametrize(
    ("filter_", "weights"),
    [
        (DIFFERENCES.of(1.0), [1.0, -1.0]),
        (DIFFERENCES_TWICE.of(1.0), twice([1.0, -1.0])),
        (SLOPES.of(3.0), [0.5, 0.0, -0.5]),
        (SLOPES_TWICE.of(3.0), twice([0.5, 0.0, -0.5])),
        (SLOPES.of(9.0), signal.savgol_coeffs(9, 2, deriv=1)),
    ],
    ids=lambda given: given.name if isinstance(given, RecordingFilter) else "",
)
def test_a_derivative_is_that_of_its_weights(filter_: RecordingFilter, weights: Any) -> None:
    """Of the motion it is a filter, whose noise is that of what was differentiated."""
    times = 2 if filter_.name.endswith("twice") else 1
    expected = np.abs(signal.freqz(weights, 1.0, OMEGA)[1])
    np.testing.assert_allclose(np.abs(filter_.response(OMEGA)), expected / OMEGA**times, atol=1e-9)
    np.testing.assert_allclose(filter_.power_of_noise(OMEGA), expected**2 / ANGLE ** (2 * times), atol=1e-9)
    assert filter_.power_of_noise(np.array([ANGLE]))[0] == pytest.approx(filter_.gain**2)


def test_nothing_of_a_position_is_a_derivative() -> None:
    derived = [
        sum("derivative" in kind.of(float(kind.sizes[0])).name for kind in kinds_for(ANGLE, order))
        for order in range(3)
    ]
    assert derived == [0, 2, 4]


@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_the_motion_itself_is_not_delayed(kind: int) -> None:
    filter_ = replace(KINDS[kind].of(float(KINDS[kind].sizes[:4][-1])), in_time=False)
    wave = np.cos(ANGLE * np.arange(4000))
    shown = Through(wave[:, None])(filter_)[:, 0]
    inside = slice(10 * margin(ANGLE), -10 * margin(ANGLE))
    left = shown[inside] - filter_.gain * wave[inside]
    # what an AC coupling still remembers of the start falls off as it settles
    memory = filter_.memory(wave.size)[inside]
    if memory.size:
        left = left - memory @ np.linalg.lstsq(memory, left)[0]
    assert np.max(np.abs(left)) < 0.01


def test_behind_a_high_pass_the_motion_is_in_its_own_time() -> None:
    filter_ = COUPLING.of(0.2 * ANGLE)
    assert filter_.in_time
    assert filter_.delay == pytest.approx(-math.atan(0.2) / ANGLE)
    at_motion = np.array([ANGLE])
    assert abs(np.angle(filter_.without_delay(at_motion)[0])) == pytest.approx(math.atan(0.2))
    assert np.angle(replace(filter_, in_time=False).without_delay(at_motion)[0]) == pytest.approx(
        0.0, abs=1e-12
    )


@pytest.mark.parametrize("order", [1, 2, 4])
def test_a_filter_that_was_empty_differs_by_what_it_remembers(order: int) -> None:
    filter_ = ONE_WAY[order].of(5.0 * ANGLE)
    b, a = signal.butter(order, 5.0 * ANGLE / math.pi)
    wave = np.cos(ANGLE * np.arange(-2000, 1000))
    left = signal.lfilter(b, a, wave[2000:]) - signal.lfilter(b, a, wave)[2000:]
    memory, seen = filter_.memory(left.size), slice(margin(ANGLE), None)
    assert np.max(np.abs(left[seen])) > 1e-4
    left -= memory @ np.linalg.lstsq(memory[seen], left[seen])[0]
    assert np.max(np.abs(left[seen])) < 1e-4


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("corner", [1.5, 4.0])
def test_a_filter_that_ran_backward_has_seen_what_came_after(order: int, corner: float) -> None:
    filter_ = BOTH_WAYS[order].of(corner * ANGLE)
    wave = np.cos(ANGLE * np.arange(1000) + 0.3)
    inside = slice(margin(ANGLE), -margin(ANGLE))
    left = (Through(wave[:, None])(filter_)[:, 0] - filter_.gain * wave)[inside]
    unseen = filter_.unseen(wave.size)[inside]
    left -= unseen @ np.linalg.lstsq(unseen, left)[0]
    assert np.max(np.abs(left)) < 1e-6


@pytest.mark.parametrize("order", [1, 3])
def test_a_real_pole_has_one_memory_at_any_corner(order: int) -> None:
    """At a high corner it changes sign from sample to sample, and no second column is to be of rounding."""
    memory = ONE_WAY[order].of(float(ONE_WAY[order].sizes[-1])).memory(300)
    assert np.all(np.max(np.abs(memory), axis=0) > 1e-3)


def test_a_record_may_begin_with_an_empty_filter() -> None:
    """Its corner is determined by noise 80 dB below the motion, and friction to 1e-3."""
    record = filtered("displacement", 8.0, order=4, start=0.04, duration=9.0)
    found = fb.estimate(record, SYSTEM)
    assert found.friction.mean() == pytest.approx(1.0, abs=1e-3)
    assert "a low pass of order 4" in found.to_dict()["noise"]["filter"]["name"]


def recorded(quantity: str, process: Process, noise_sd: float, seed: int = 4) -> xr.DataArray:
    record = fb.simulate(
        SYSTEM,
        friction=1.0,
        initial_displacement=0.05,
        duration=12.0,
        sampling_rate=RATE,
        noise_sd=noise_sd,
        seed=seed,
        quantity=quantity,
    )
    return fb.make_record(record["time"].values, process(record.values), quantity)


def coupled(values: np.ndarray) -> np.ndarray:
    sos = signal.butter(1, 0.1 * 10.0 / (2.0 * math.pi), btype="highpass", fs=RATE, output="sos")
    return np.asarray(signal.sosfilt(sos, values))


def mounted(values: np.ndarray) -> np.ndarray:
    """On a mount that resonates at nine times the frequency of the motion."""
    b, a = signal.bilinear([90.0**2], [1.0, 2.0 * 0.05 * 90.0, 90.0**2], fs=RATE)
    return np.asarray(signal.lfilter(b, a, values))


def picked_up(values: np.ndarray) -> np.ndarray:
    b, a = signal.bilinear([1.0, 0.0, 0.0], [1.0, 2.0 * 0.6 * 3.5, 3.5**2], fs=RATE)
    return np.asarray(signal.lfilter(b, a, values))


@pytest.mark.parametrize(
    ("quantity", "process", "noise_sd", "name"),
    [
        ("displacement", lambda v: signal.savgol_filter(v, 21, 3), 1e-4, "a polynomial of degree 2"),
        ("velocity", lambda v: np.convolve(v, np.ones(9) / 9.0, mode="same"), 1e-3, "a moving mean of 9 "),
        ("displacement", lambda v: signal.lfilter(np.ones(8) / 8.0, [1.0], v), 1e-4, "a moving mean of 8 "),
        (
            "displacement",
            lambda v: np.convolve(v, np.bartlett(15)[1:-1] / 7.0, mode="same"),
            1e-4,
            "a moving mean of 7 samples, twice",
        ),
        (
            "displacement",
            lambda v: signal.filtfilt(*signal.butter(3, 0.2), v),
            1e-4,
            "a low pass of order 3, forward and backward",
        ),
        (
            "displacement",
            lambda v: signal.filtfilt(*signal.butter(1, 0.2), v),
            1e-5,
            "a low pass of order 1, forward and backward",
        ),
        (
            "displacement",
            lambda v: ndimage.gaussian_filter1d(np.pad(v, 20, "reflect", reflect_type="odd"), 4.5)[20:-20],
            1e-4,
            "Gaussian weights",
        ),
        (
            "velocity",
            lambda v: np.convolve(v, signal.windows.hann(15)[1:-1] / 7.0, mode="same"),
            1e-3,
            "a Hann window of 13 ",
        ),
        ("displacement", lambda v: signal.lfilter([0.4], [1.0, -0.6], v), 1e-5, "exponential smoothing"),
        ("displacement", lambda v: signal.lfilter(*signal.bessel(4, 0.15), v), 1e-5, "a Bessel filter"),
        ("acceleration", coupled, 2e-2, "an AC coupling"),
        ("displacement", coupled, 1e-5, "an AC coupling"),
        ("acceleration", mounted, 2e-2, "a resonance of the mount"),
    ],
)
def test_what_a_filter_takes_is_put_back(quantity: str, process: Process, noise_sd: float, name: str) -> None:
    found = fb.estimate(recorded(quantity, process, noise_sd), SYSTEM)
    filter_ = found.to_dict()["noise"]["filter"]
    assert filter_ is not None
    assert filter_["name"].startswith(name)
    low, high = found.friction.ppf([0.05, 0.95])
    assert abs(found.friction.mean() - 1.0) < high - low < 0.03
    witness = found.fit.witness
    assert witness is not None
    assert witness.agrees


def test_what_rings_at_the_corners_may_be_a_mount_or_a_second_mode() -> None:
    """A mode at six times the frequency, which friction drives and which leaves the motion as it is.

    The mount whose resonance rings alike shows 1.029 of it: friction was too small by that, for certain.
    """
    sections = signal.bilinear(
        [2.0 * 0.05 * 60.0, 60.0**2 - 10.0**2], [1.0, 2.0 * 0.05 * 60.0, 60.0**2], fs=RATE
    )
    found = fb.estimate(recorded("displacement", lambda v: signal.lfilter(*sections, v), 1e-5), SYSTEM)
    assert found.fit.filter is not None
    assert found.fit.filter.name.startswith("a resonance of the mount or a second mode")
    low, high = found.friction.interval(0.9)
    assert low < 1.0 < high < low + 0.08


def test_what_a_geophone_amplifies_is_put_back() -> None:
    """It shows 1.041 of the motion; its corner and damping are known to a few hundredths each."""
    found = fb.estimate(recorded("velocity", picked_up, 1e-3), SYSTEM)
    filter_ = found.to_dict()["noise"]["filter"]
    assert filter_ is not None
    assert filter_["name"].startswith("a high pass of order 2")
    # of the filters of all corners and dampings that are about as probable as the one that is named
    gain = sum(account.probability * account.gain for account in found.fit.accounts)
    assert gain == pytest.approx(1.041, abs=0.02)
    low, high = found.friction.ppf([0.05, 0.95])
    assert low < 1.0 < high < low + 0.06


def test_a_kind_that_leaves_a_force_gives_way_to_one_that_leaves_none() -> None:
    """Second order both ways has nearly this spectrum, and takes next to nothing of the motion."""
    sections = signal.bessel(4, 2.2 * 10.0 / (2.0 * math.pi), fs=240.0, output="sos", norm="mag")
    found = fb.estimate(settled(sections, noise_sd=8e-5, seed=2), SYSTEM)
    assert found.fit.filter is not None
    assert found.fit.filter.name.startswith("a Bessel filter")
    low, high = found.friction.interval(0.9)
    assert low < 1.0 < high < low + 0.03


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("force_sd", [0.0, 3e-4])
def test_no_filter_is_found_in_white_noise_or_under_a_force(
    rng: np.random.Generator, order: int, force_sd: float
) -> None:
    """A force colours what the law leaves of a motion, and no filter is to take its place."""
    motion = fluctuating_decay(
        rng,
        frequency=10.0,
        friction=1e-3,
        release=0.05,
        step=1.0 / RATE,
        samples=1200,
        force_sd=force_sd,
        correlation_time=0.1,
    )[order]
    noise = 1e-3 * float(np.std(motion)) * rng.standard_normal(motion.size)
    quantity = ("displacement", "velocity", "acceleration")[order]
    record = fb.make_record(np.arange(motion.size) / RATE, motion + noise, quantity)
    found = fb.estimate(record, SYSTEM)
    filter_ = found.to_dict()["noise"]["filter"]
    assert filter_ is None or abs(filter_["gain"] - 1.0) < 1e-3
    low, high = found.friction.ppf([0.05, 0.95])
    assert abs(found.friction.mean() - 1.0) < high - low


def test_an_improbable_force_is_evaluated_behind_one_filter_of_a_kind() -> None:
    found = fb.estimate(filtered("displacement", 12.0), SYSTEM)
    assert found.random_force is not None
    assert found.random_force.probability < 1e-3
    listed = [each for each in found.fit.accounts if each.filter is not None and each.unlisted is None]
    still, forced = (
        {each.filter.name for each in listed if each.filter is not None and each.forced is force}
        for force in (False, True)
    )
    assert len(still) > 3
    assert len(forced) == 1
    assert forced < still


def test_a_memory_behind_weights_is_that_of_the_weighted_samples() -> None:
    """A whitener sees of it what convolution does, from where it knows all samples before."""
    filter_, weights = ONE_WAY[3].of(1.6 * ANGLE), np.array([1.0, -0.8, 0.3])
    behind = np.exp(np.multiply.outer(-filter_.settling, np.arange(weights.size))) @ weights
    plain, seen = filter_.memory(60), filter_.memory(60, behind)
    convolved = np.apply_along_axis(lambda column: np.convolve(column, weights)[:60], 0, plain)
    np.testing.assert_allclose(seen[2:], convolved[2:], rtol=1e-9, atol=1e-12)


def test_a_blend_has_the_mean_and_the_spread_of_its_filters() -> None:
    """A record behind it varies with its doubts as it does from filter to filter."""
    shares = np.array([0.6, 0.3, 0.1])
    found = [BOTH_WAYS[1].of(8.0 * ANGLE), ONE_WAY[2].of(4.0 * ANGLE), MEAN.of(9.0)]
    motion = (np.cos(ANGLE * np.arange(800)) * np.linspace(1.0, 0.3, 800))[:, None]
    through = Through(motion)
    blend = blended(list(zip(shares, found, strict=True)), motion[:, 0])
    shown = np.hstack([through(each) for each in found])
    np.testing.assert_allclose(through(blend)[:, 0], shown @ shares, atol=1e-12)
    # of each filter, and of the next of its kind where a size in between may be the right one
    apart = [math.sqrt(share) * (each - shown @ shares) for share, each in zip(shares, shown.T, strict=True)]
    own = [math.sqrt(s) * through.doubts(f) for s, f in zip(shares, found, strict=True)]
    every = np.column_stack([*apart, *own])
    doubts = through.doubts(blend)
    assert doubts.shape[1] == 3
    values, vectors = np.linalg.eigh(every.T @ every)
    leading = every @ vectors[:, -3:]
    np.testing.assert_allclose(doubts @ doubts.T, leading @ leading.T, atol=1e-9 * values[-1])
    assert blend.name == found[0].name


def test_one_filter_of_a_known_size_is_no_blend() -> None:
    only = MEAN.of(5.0)
    assert blended([(1.0, only)], np.cos(ANGLE * np.arange(500))) is only


def test_low_passes_are_tried_from_where_they_take_of_the_motion_or_leave_of_its_corners() -> None:
    for kind in (*LOW_PASSES, BESSEL, GAUSSIAN, SMOOTHING):
        lowest = kind.sizes[0] / ANGLE
        takes = 1.0 - kind.of(3.0 * ANGLE).gain
        assert lowest == pytest.approx(1.5 if takes > 1e-3 else 3.0)
