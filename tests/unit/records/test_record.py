"""Which records are refused, in which words, and what an even grid is."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import STANDARD_GRAVITY
from friction_bayes.records.clock import is_even, sampling_interval
from friction_bayes.records.record import make_record, validate_record, with_values, within

N, STEP = 400, 0.01
TIME = np.arange(N) * STEP
SIGNAL = 0.01 * np.cos(8.0 * TIME) * (1.0 - TIME / 5.0)


def record_over(time, values=SIGNAL):
    return make_record(time, values, "displacement", name="swing.csv")


def test_make_record_converts_to_si() -> None:
    record = make_record(TIME, np.full(N, 2.0), "acceleration", unit="g")
    assert record.attrs["units"] == "m/s2"
    np.testing.assert_allclose(record.values, 2.0 * STANDARD_GRAVITY, rtol=1e-15)


class Quantity(np.ndarray):
    """Numbers with a unit, as packages of units have them."""

    @property
    def magnitude(self):
        return np.asarray(self)

    def to(self, unit):
        factor = {"m": 1e-3, "s": 60.0}[unit]
        return (factor * self).view(Quantity)


def test_quantities_are_converted_to_si() -> None:
    time, values = (each.view(Quantity) for each in (TIME / 60.0, 1e3 * SIGNAL))
    record = record_over(time, values)
    np.testing.assert_allclose(record.values, SIGNAL, rtol=1e-14)
    np.testing.assert_allclose(record["time"], TIME, rtol=1e-14)
    with pytest.raises(InputError, match="unit: mm is given for values that have a unit"):
        make_record(TIME, values, "displacement", unit="mm")


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
    ],
)
def test_make_record_refuses_what_is_not_numbers_over_time(time, values, message) -> None:
    with pytest.raises(InputError, match=message):
        make_record(time, values, "displacement")


@pytest.mark.parametrize("start", [np.datetime64("2026-03-01T12:00:00"), np.timedelta64(0, "ns")])
def test_dates_and_time_differences_count_from_the_first(start) -> None:
    stamps = start + (np.arange(N) * 10_000_000).astype("timedelta64[ns]")
    np.testing.assert_allclose(record_over(stamps)["time"], TIME, atol=1e-12)


def test_masked_samples_are_left_out_with_their_times() -> None:
    masked = np.ma.masked_array(SIGNAL, np.arange(N) == 7)
    record = record_over(TIME, masked)
    np.testing.assert_array_equal(record.values, np.delete(SIGNAL, 7))
    np.testing.assert_array_equal(record["time"], np.delete(TIME, 7))


def test_a_column_of_objects_is_numbers_or_names_the_row() -> None:
    np.testing.assert_array_equal(record_over(TIME, SIGNAL.astype(object)).values, SIGNAL)
    mixed = SIGNAL.astype(object)
    mixed[3] = "n/a"
    with pytest.raises(InputError, match=r"swing\.csv: signal is 'n/a' at row 3, counted from 0"):
        record_over(TIME, mixed)


def test_a_unit_that_is_no_attribute_is_refused() -> None:
    with pytest.raises(InputError, match=r"units: .*unit=, which converts"):
        make_record(TIME, SIGNAL, "displacement", units="mm")


def test_a_valid_record_passes_unchanged() -> None:
    record = record_over(TIME)
    assert validate_record(record) is record
    assert sampling_interval(record) == pytest.approx(STEP, rel=1e-12)


def test_other_values_leave_the_rest_as_it_is() -> None:
    record = record_over(TIME)
    xr.testing.assert_identical(with_values(record, 2.0 * SIGNAL), record.copy(data=2.0 * SIGNAL))
    np.testing.assert_array_equal(record.values, SIGNAL)


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


def test_either_side_of_a_clock_that_jumps_back_can_be_taken() -> None:
    late = TIME.copy()
    late[50:] -= 0.055
    record = record_over(late)
    with pytest.raises(InputError, match=r"take the part before it, end=0\.49"):
        validate_record(record)
    before, after = record[within(record, None, 0.49)], record[within(record, 0.5, None)]
    np.testing.assert_array_equal(validate_record(before)["time"], TIME[:50])
    np.testing.assert_array_equal(validate_record(after)["time"], late[late > 0.495])


def test_a_clock_that_begins_anew_is_two_recordings() -> None:
    twice = record_over(np.tile(TIME, 2), np.tile(SIGNAL, 2))
    with pytest.raises(
        InputError, match=rf"begins anew at sample {N + 1} \(t = 0 s\).* 2 recordings.*; split"
    ):
        validate_record(twice)
    swapped = TIME.copy()
    swapped[[0, 1]] = TIME[[1, 0]]
    with pytest.raises(InputError, match="runs backwards"):
        validate_record(record_over(swapped))


def test_a_clock_that_jumps_back_by_an_hour_is_that_of_summer_time() -> None:
    late = TIME.copy()
    late[50:] -= 3600.0
    with pytest.raises(
        InputError, match=r"an hour at sample 51 .*as where summer time ends; give sampling_rate=100$"
    ):
        validate_record(record_over(late))
    late[20] += 0.3 * STEP
    with pytest.raises(InputError, match="add an hour to the times from there on"):
        validate_record(record_over(late))
    two_of_an_hour = np.tile(np.linspace(0.0, 3600.0, N // 2, endpoint=False), 2)
    with pytest.raises(InputError, match="begins anew"):
        validate_record(record_over(two_of_an_hour))


def test_what_is_proposed_of_doubled_times_leads_on() -> None:
    twice = TIME.copy()
    twice[3] = twice[2]
    with pytest.raises(InputError) as refused:
        validate_record(record_over(twice))
    assert "duplicates=first" in str(refused.value)
    assert "end=" not in str(refused.value)
    with pytest.raises(
        InputError, match=rf"sample 2 \(t = 0 s\): {N} samples have {N // 50} times; give sampling_rate=100$"
    ):
        validate_record(record_over(np.floor(TIME / 0.5 + 1e-9) * 0.5))
    with pytest.raises(InputError, match=r"give sampling_rate=333\.097$"):
        validate_record(record_over((np.arange(N) / 333.0).round(2)))
    early = TIME.copy()
    early[9] = early[7]
    with pytest.raises(InputError, match=r"sort the rows; if the clock is at fault, give sampling_rate$"):
        validate_record(record_over(early))


def test_times_are_reported_in_the_unit_of_the_file() -> None:
    backwards = TIME.copy()
    backwards[50] = TIME[48]
    with pytest.raises(InputError, match=r"runs backwards from 490 ms at sample 51 \(t = 480 ms\)"):
        validate_record(record_over(backwards), time_unit="ms")


@pytest.mark.parametrize("jitter", [0.0, 1e-3, 5e-3])
def test_jitter_within_tolerance_is_even(jitter, rng) -> None:
    record = record_over(TIME + jitter * STEP * rng.uniform(-1.0, 1.0, N))
    assert is_even(record["time"].values)
    # the two ends are off by at most the jitter, over the whole record
    assert sampling_interval(record) == pytest.approx(STEP, rel=2.0 * jitter / (N - 1) + 1e-12)


def test_time_stamps_rounded_to_a_thousandth_of_a_step_are_even() -> None:
    record = record_over(np.round(np.arange(N) / 300.0, 6))
    assert is_even(record["time"].values)
    assert sampling_interval(record) == pytest.approx(1.0 / 300.0, rel=1e-6)


def test_jitter_a_late_stamp_and_a_change_of_rate_are_uneven_and_kept(rng) -> None:
    late = TIME.copy()
    late[200] += 0.1 * STEP
    slower = np.concatenate([TIME[:200], TIME[199] + 1.02 * STEP * np.arange(1, 201)])
    for time in (TIME + 0.03 * STEP * rng.uniform(-1.0, 1.0, N), late, slower):
        record = record_over(time)
        assert not is_even(time)
        assert validate_record(record) is record


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
