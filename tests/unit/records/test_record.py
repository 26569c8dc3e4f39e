"""Which records are refused, in which words, and what resampling does."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import STANDARD_GRAVITY
from friction_bayes.records.clock import sampling_interval
from friction_bayes.records.record import make_record, validate_record
from friction_bayes.records.resampling import resample_record

N, STEP = 400, 0.01
TIME = np.arange(N) * STEP
SIGNAL = 0.01 * np.cos(8.0 * TIME) * (1.0 - TIME / 5.0)


def record_over(time, values=SIGNAL):
    return make_record(time, values, "displacement", name="swing.csv")


def test_make_record_converts_to_si() -> None:
    record = make_record(TIME, np.full(N, 2.0), "acceleration", unit="g")
    assert record.attrs["units"] == "m/s2"
    np.testing.assert_allclose(record.values, 2.0 * STANDARD_GRAVITY, rtol=1e-15)


def test_uncalibrated_units_are_kept() -> None:
    record = make_record(TIME, SIGNAL, "angular_velocity", unit="mV")
    assert record.attrs["units"] == "mV"
    np.testing.assert_array_equal(record.values, SIGNAL)


@pytest.mark.parametrize(
    ("time", "values", "message"),
    [
        (TIME[:-1], SIGNAL, "399 times for 400 samples"),
        (TIME, np.array(["a"] * N), "signal is an array of <U1"),
        (TIME, SIGNAL.reshape(2, -1), r"shape \(2, 200\)"),
        (TIME, SIGNAL + 0j, "complex128"),
        (TIME.astype("datetime64[s]"), SIGNAL, "datetime64"),
    ],
)
def test_make_record_refuses_what_is_not_numbers_over_time(time, values, message) -> None:
    with pytest.raises(InputError, match=message):
        make_record(time, values, "displacement")


def test_a_valid_record_passes_unchanged() -> None:
    record = record_over(TIME)
    assert validate_record(record) is record
    assert sampling_interval(record) == pytest.approx(STEP, rel=1e-12)


@pytest.mark.parametrize(("bad", "word"), [(np.nan, "nan"), (np.inf, "inf"), (-np.inf, "-inf")])
def test_what_is_not_finite_is_named_with_its_place(bad, word) -> None:
    values = SIGNAL.copy()
    values[[30, 77]] = bad
    with pytest.raises(
        InputError, match=rf"swing.csv: signal is {word} at sample 31 \(t = 0.3 s\) and 1 more"
    ):
        validate_record(record_over(TIME, values))


def test_rows_of_the_file_are_named_when_known() -> None:
    values = SIGNAL.copy()
    values[30] = np.nan
    with pytest.raises(InputError, match=r"at row 34 \(t = 0.3 s\)"):
        validate_record(record_over(TIME, values), rows=np.arange(N) + 4)


@pytest.mark.parametrize("level", [0.0, 3.0, 1e8])
def test_constant_signal_is_refused(level) -> None:
    with pytest.raises(InputError, match="constant at"):
        validate_record(record_over(TIME, np.full(N, level)))


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(InputError, match="7 samples; give at least 8"):
        validate_record(record_over(TIME[:7], SIGNAL[:7]))


def test_time_running_backwards_or_doubled_is_refused() -> None:
    backwards, doubled = TIME.copy(), TIME.copy()
    backwards[50] = backwards[48]
    doubled[50] = doubled[49]
    with pytest.raises(InputError, match=r"runs backwards from 0.49 s at sample 51 \(t = 0.48 s\)"):
        validate_record(record_over(backwards))
    with pytest.raises(InputError, match=r"time is doubled at sample 51 \(t = 0.49 s\)"):
        validate_record(record_over(doubled))


def test_a_gap_is_refused_and_named() -> None:
    keep = np.r_[:100, 110:N]
    with pytest.raises(
        InputError,
        match=r"gap of 0.11 s after sample 100 \(t = 0.99 s\).*cut the record there, by --start or --end$",
    ):
        validate_record(record_over(TIME[keep], SIGNAL[keep]))


@pytest.mark.parametrize("jitter", [0.0, 1e-3, 5e-3])
def test_jitter_within_tolerance_is_uniform(jitter, rng) -> None:
    record = record_over(TIME + jitter * STEP * rng.uniform(-1.0, 1.0, N))
    assert validate_record(record) is record
    # the two ends are off by at most the jitter, over the whole record
    assert sampling_interval(record) == pytest.approx(STEP, rel=2.0 * jitter / (N - 1) + 1e-12)


def test_time_stamps_rounded_to_a_thousandth_of_a_step_are_uniform() -> None:
    record = record_over(np.round(np.arange(N) / 300.0, 6))
    assert validate_record(record) is record
    assert sampling_interval(record) == pytest.approx(1.0 / 300.0, rel=1e-6)


@pytest.mark.parametrize("jitter", [0.03, 0.2])
def test_jitter_beyond_tolerance_is_refused_with_its_numbers(jitter, rng) -> None:
    record = record_over(TIME + jitter * STEP * rng.uniform(-1.0, 1.0, N))
    with pytest.raises(InputError, match=r"not uniform: intervals .*resample_record"):
        validate_record(record)


def test_a_single_late_stamp_is_refused() -> None:
    time = TIME.copy()
    time[200] += 0.1 * STEP
    with pytest.raises(InputError, match="not uniform"):
        validate_record(record_over(time))


def test_a_change_of_rate_is_refused() -> None:
    time = np.concatenate([TIME[:200], TIME[199] + 1.02 * STEP * np.arange(1, 201)])
    with pytest.raises(InputError, match="not uniform"):
        validate_record(record_over(time))


@pytest.mark.parametrize(
    ("record", "message"),
    [
        (xr.DataArray(np.ones((2, N)), dims=("record", "time")), "dimensions"),
        (xr.DataArray(SIGNAL, dims=("time",)), "with its coordinate"),
        (xr.DataArray(SIGNAL, coords={"time": TIME}, dims=("time",)), "unknown quantity ''"),
        (record_over(TIME).assign_attrs(units="mm"), "in unit 'mm' instead of m"),
        (record_over(TIME).assign_attrs(quantity="angle"), "in unit 'm' instead of rad"),
    ],
)
def test_what_is_not_a_record_is_refused(record, message) -> None:
    with pytest.raises(InputError, match=message):
        validate_record(record)


def test_resampling_brings_the_signal_onto_an_even_grid(rng) -> None:
    time = TIME + 0.3 * STEP * rng.uniform(-1.0, 1.0, N)
    uneven = record_over(time, 0.01 * np.cos(8.0 * time))
    even = resample_record(uneven)
    validate_record(even)
    # cubic splines err by (h w)**4 * 5/384 of the amplitude, here h w = 0.13 at worst; ends are worse
    np.testing.assert_allclose(even.values, 0.01 * np.cos(8.0 * even["time"].values), atol=1e-6)
    assert even.attrs["resampled"].startswith("cubic spline onto")
    assert {**even.attrs, "resampled": None} == {**uneven.attrs, "resampled": None}


def test_resampling_fills_a_lost_sample_and_keeps_the_others() -> None:
    keep = np.delete(np.arange(N), 100)
    even = resample_record(record_over(TIME[keep], SIGNAL[keep]))
    np.testing.assert_allclose(even["time"].values, TIME, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(even.values, SIGNAL, atol=1e-7)


def test_resampling_keeps_to_rounded_time_stamps() -> None:
    """A camera of 12 frames a second, its stamps in whole milliseconds: the grid is that of the frames."""
    frames = np.delete(np.arange(400), 100)
    stamps = np.round(frames / 12.0, 3)
    even = resample_record(record_over(stamps, 0.01 * np.cos(3.0 * stamps)))
    np.testing.assert_allclose(even["time"].values, np.arange(400) / 12.0, atol=1e-3)


def test_resampling_does_not_invent_what_a_long_gap_lost() -> None:
    keep = np.r_[:100, 110:N]
    with pytest.raises(InputError, match="cut the record there"):
        resample_record(record_over(TIME[keep], SIGNAL[keep]))


def test_resampling_keeps_flat_tops_flat(rng) -> None:
    time = TIME + 0.2 * STEP * rng.uniform(-1.0, 1.0, N)
    clipped = np.minimum(0.01 * np.cos(8.0 * time), 0.006)
    even = resample_record(record_over(time, clipped))
    assert np.count_nonzero(even.values == 0.006) > 0.9 * np.count_nonzero(clipped == 0.006) - 20


def test_resampling_refuses_time_running_backwards() -> None:
    time = TIME.copy()
    time[50] = time[40]
    with pytest.raises(InputError, match="backwards"):
        resample_record(record_over(time))
