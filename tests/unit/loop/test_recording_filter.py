"""A record that went through a filter, as a closed loop takes it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy import signal

import friction_bayes as fb
from filtered_decays import SYSTEM, decay, filtered
from friction_bayes.estimators.noise.recording_filters import kinds_for
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.data.parameters import scales_of
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.noise.correlated_noise import NO_ERROR, SensorError

OFFERED = [
    "viscous_damping",
    "friction_drift",
    "presliding",
    "cubic_stiffness",
    "random_force",
    "sensor_offset",
]
"""Few of the catalogue, so that a test takes seconds; one filter is found next to all of it."""


@pytest.mark.parametrize(
    ("quantity", "corner", "order", "both", "rate", "offered"),
    [
        ("velocity", 30.0, 4, True, 250.0, OFFERED),
        ("velocity", 8.0, 2, False, 200.0, None),
        ("acceleration", 12.0, 2, False, 200.0, OFFERED),
    ],
)
def test_the_loop_sees_a_filter_and_takes_it_for_no_law(
    quantity: str, corner: float, order: int, both: bool, rate: float, offered: list[str] | None
) -> None:
    record = filtered(quantity, corner, order=order, rate=rate, both=both, duration=7.0)
    report = fb.close_loop([record], SYSTEM, seed=1, effects=offered)
    assert report.verdict == "adequate"
    low, high = report.friction_after["interval90"]
    assert low - 0.005 < 1.0 < high + 0.005
    assert high - low < 0.02
    assert report.noise["filter"]["name"].startswith("a low pass")
    # the rest of the record is forecast as the filter shows it
    assert report.held_out_error["after"] < 1.5 * report.held_out_error["before"]
    assert report.held_out_error["inside90"] > 0.8


def test_positions_differentiated_twice_are_known_as_such() -> None:
    """A jump between two samples shows in both, by its place; the loop is in ``test_coloured_noise.py``."""
    record = decay(duration=7.0)
    time = record["time"].values
    values = np.gradient(np.gradient(record.values, time), time)
    twice = fb.make_record(time, values, "acceleration")
    found = fb.estimate(twice, SYSTEM)
    filter_ = found.to_dict()["noise"]["filter"]
    assert filter_ is not None
    assert filter_["name"] == "a derivative by slopes over 3 samples, twice"
    low, high = found.friction.interval(0.98)
    assert low < 1.0 < high < low + 0.02


def test_the_loop_finds_the_damping_behind_a_filter() -> None:
    damped = {"viscous_damping.damping_ratio": 0.004}
    record = filtered("displacement", 12.0, duration=7.0, effects=damped)
    report = fb.close_loop([record], SYSTEM, seed=1, effects=OFFERED)
    assert report.noise["filter"] is not None
    assert report.candidates[0]["effects"] == ["viscous_damping"]
    low, high = report.friction_after["interval90"]
    assert low < 1.0 < high


def test_filters_that_a_short_record_cannot_tell_apart_make_friction_uncertain() -> None:
    record, share = decay(duration=4.2), 0.3
    values = signal.lfilter(
        [share], [1.0, share - 1.0], record.values, zi=[(1.0 - share) * record.values[0]]
    )[0]
    record = fb.make_record(record["time"].values, values, "displacement")
    report = fb.close_loop([record], SYSTEM, seed=1, effects=["viscous_damping", "random_force"])
    assert report.noise["filter"] is not None
    low, high = report.friction_after["interval90"]
    assert low < 1.0 < high < low + 0.02


def test_a_record_without_a_filter_is_behind_none() -> None:
    record = decay(duration=8.0, effects={"presliding.displacement": 1e-3})
    assert fb.close_loop([record], SYSTEM, seed=1).noise["filter"] is None


def test_records_of_one_sensor_are_behind_its_filter_together() -> None:
    records = [filtered("displacement", 12.0, start=start, duration=5.0) for start in (0.05, 0.04)]
    report = fb.close_loop(records, SYSTEM, seed=1, effects=OFFERED)
    assert report.verdict == "adequate"
    assert report.noise["filter"]["name"].startswith("a low pass of order 2")
    assert report.friction_after["mean"] == pytest.approx(1.0, abs=5e-4)
    assert report.held_out_error["after"] < 1.5 * report.held_out_error["before"]


def averaged(rng: np.random.Generator, start: float, duration: float, noise_sd: float) -> xr.DataArray:
    """A decay as a moving mean shows it, under noise that came later."""
    record, window = decay(start=start, duration=duration, rate=100.0), 15
    values = np.convolve(record.values, np.ones(window) / window, mode="valid")
    values += noise_sd * rng.standard_normal(values.size)
    return fb.make_record(record["time"].values[: values.size], values, "displacement")


def test_records_that_show_their_filter_unequally_well_are_behind_it_together(
    rng: np.random.Generator,
) -> None:
    """Of the long one it is certain; the short one has columns for how probable filters differ."""
    records = [averaged(rng, 0.05, 9.0, 2e-6), averaged(rng, 0.03, 3.0, 8e-6)]
    report = fb.close_loop(records, SYSTEM, seed=1, effects=["viscous_damping", "random_force"])
    assert report.noise["filter"]["name"] == "a moving mean of 15 samples"
    low, high = report.friction_after["interval90"]
    assert low - 0.005 < 1.0 < high + 0.005


def test_what_was_put_into_a_gap_is_not_measured_behind_a_filter_either() -> None:
    (segment,) = cut_records([filtered("acceleration", 12.0, lost=12, duration=7.0)], SYSTEM)
    assert segment.in_gaps.sum() == 12
    assert segment.near_jumps.any()
    assert not (segment.near_jumps & segment.in_gaps).any()
    whole = MovingRecord.of(segment, SYSTEM, OFFERED, scales_of([segment], SYSTEM))
    kind = next(
        each for each in kinds_for(segment.decay.frequency * segment.decay.step, 2) if each.sizes.size
    )
    behind = whole.behind(kind.of(kind.sizes[0]))
    inside, n = behind.known, behind.samples
    fitted = np.isfinite(behind.variance[inside])
    assert not fitted[segment.in_gaps[:n][inside]].any()
    assert fitted[segment.near_jumps[:n][inside]].all()


def test_a_record_with_several_gaps_is_seen_behind_its_filter() -> None:
    """What is put into them is no evidence against it: friction was .76 +- .5 N so."""
    record = filtered("velocity", 12.0, duration=7.0)
    lost = (np.arange(record.size) % 100 >= 50) & (np.arange(record.size) % 100 < 62)
    record = record[~lost]
    report = fb.close_loop([record], SYSTEM, seed=1, effects=OFFERED)
    assert report.verdict == "adequate"
    assert report.noise["filter"]["name"].startswith("a low pass")
    low, high = report.friction_after["interval90"]
    assert low - 0.001 < 1.0 < high + 0.001
    assert high - low < 0.01


def test_a_filter_is_seen_where_a_sample_is_missing() -> None:
    """The clock counted as uneven, behind which no filter was looked for: friction was 3 % low."""
    record = averaged(np.random.default_rng(1), 0.05, 9.0, 2e-6)
    kept = np.ones(record.size, np.bool_)
    kept[[150, 400, 401]] = False
    report = fb.close_loop([record[kept]], SYSTEM, seed=1, effects=["viscous_damping", "random_force"])
    assert report.noise["filter"]["name"] == "a moving mean of 15 samples"
    low, high = report.friction_after["interval90"]
    assert low - 0.005 < 1.0 < high + 0.005


def test_lost_rows_cost_a_mean_of_many_little() -> None:
    """Blocks with a row lost were set aside, all of them with one in five."""
    record, offered = decay(duration=7.0, rate=5000.0), ["viscous_damping", "random_force"]
    widths = []
    for share in (0.0, 0.2):
        kept = np.random.default_rng(3).random(record.size) >= share
        report = fb.close_loop([record[kept]], SYSTEM, seed=1, effects=offered)
        assert report.verdict == "adequate"
        low, high = report.friction_after["interval90"]
        assert low - 1e-4 < 1.0 < high + 1e-4
        widths.append(high - low)
    assert widths[1] < 2.0 * widths[0]


def test_an_error_of_the_sensor_is_the_same_as_far_as_it_is_searched_for() -> None:
    found = SensorError(2.0, 0.1, -1.0)
    assert found.alike(replace(found, ratio=2.0 * math.exp(0.09)))
    assert not found.alike(replace(found, correlation_time=0.1 * math.exp(0.11)))
    assert not found.alike(NO_ERROR)
    assert NO_ERROR.alike(SensorError())
