"""Batches: the numbers of single estimates, bad records flagged, arrays of every kind."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import dask
import dask.array as da
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import stats

from decays import SYSTEM, long_decay, pushed_decay, short_decay
from friction_bayes import (
    Estimate,
    InputError,
    Oscillator,
    Pendulum,
    RecordWarning,
    estimate,
    estimate_batch,
    make_record,
    simulate,
)
from friction_bayes.conjugate.scaled_distribution import scaled, scaled_moments, scaled_quantiles
from friction_bayes.estimators import batch
from friction_bayes.estimators.batch import STATUS, WARNINGS
from friction_bayes.estimators.registry import ESTIMATORS

METHODS = tuple(ESTIMATORS)
# what is the same row by row to rounding
plain = partial(estimate, random_force="none")
plain_batch = partial(estimate_batch, random_force="none")
RATE = 200.0


def records(quantity: str, count: int, system: Oscillator = SYSTEM) -> np.ndarray:
    """Noisy decays that start differently."""
    rng = np.random.default_rng(7)
    rows = []
    for k in range(count):
        row = simulate(
            system,
            friction=0.2,
            initial_displacement=0.01 + 0.001 * k,
            initial_velocity=0.02 * k,
            duration=9.0,
            sampling_rate=RATE,
            quantity=quantity,
        ).values
        rows.append(row + 0.05 * row.std() * rng.standard_normal(row.size) + 0.3 * row.std())
    return np.array(rows)


def assert_same(many: xr.Dataset, k: int, one: Estimate, rtol: float = 1e-8) -> None:
    """Row ``k`` of a batch holds the numbers of a single estimate."""
    length = one.friction_over_stiffness
    expected = {
        "friction_mean": one.friction.mean(),
        "friction_sd": one.friction.std(),
        "friction_interval90": one.friction.ppf([0.05, 0.95]),
        "friction_over_stiffness_mean": length.mean(),
        "friction_over_stiffness_sd": length.std(),
        "friction_over_stiffness_interval90": length.ppf([0.05, 0.95]),
        "noise_sd": one.noise_sd,
        "frequency": one.frequency,
        "frequency_sd": one.frequency_sd,
        "rest_position": one.rest_position,
    }
    for name, value in expected.items():
        np.testing.assert_allclose(many[name][k], value, rtol=rtol, err_msg=name)


@pytest.mark.parametrize(
    ("quantity", "stiffness_sd"),
    [
        ("displacement", 0.0),
        ("displacement", 0.2),
        ("displacement", 30.0),
        ("velocity", 0.2),
        ("acceleration", 0.0),
    ],
)
@pytest.mark.parametrize("method", METHODS)
def test_same_numbers_as_estimate(quantity: str, method: str, stiffness_sd: float) -> None:
    system = Oscillator(mass=10.0, stiffness=1000.0, stiffness_sd=stiffness_sd, mass_sd=0.001 * stiffness_sd)
    values = records(quantity, 3)
    many = plain_batch(values, system, sampling_rate=RATE, quantity=quantity, method=method)
    for k, row in enumerate(values):
        one = plain(make_record(np.arange(row.size) / RATE, row, quantity), system, method=method)
        assert_same(many, k, one)
    assert many["friction_mean"].attrs["units"] == "N"
    assert many["friction_interval90"].dims == ("record", "bound")
    assert many.attrs["method"] == method


@pytest.mark.parametrize("quantity", ["displacement", "velocity"])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("friction", [0.2, 0.9])
def test_densely_sampled_records_have_the_numbers_of_single_ones(
    quantity: str, method: str, friction: float, rng: np.random.Generator
) -> None:
    """Of 628 samples a period, whose means are fitted and tracked first; of much friction one stops."""
    decay = simulate(
        SYSTEM,
        friction=friction,
        initial_displacement=0.02,
        duration=10.0,
        sampling_rate=1000.0,
        quantity=quantity,
    ).values
    rows = np.array([decay[k : k + 8000] for k in (0, 317, 802)])
    rows += 0.02 * decay.std() * rng.standard_normal(rows.shape) + 5.0 * decay.std()
    many = plain_batch(rows, SYSTEM, sampling_rate=1000.0, quantity=quantity, method=method)
    for k, row in enumerate(rows):
        one = plain(make_record(np.arange(8000) / 1000.0, row, quantity), SYSTEM, method=method)
        assert_same(many, k, one, rtol=1e-10)


@pytest.mark.parametrize("method", METHODS[1:])
def test_methods_by_amplitudes_are_warned_of_as_one_record_is(method: str) -> None:
    """Through a fit of the whole signal, which they do not make themselves."""
    values = doubtful()
    with pytest.warns(RecordWarning):
        result = estimate_batch(values, SYSTEM, sampling_rate=100.0, method=method)
    for row, bits in zip(values, result["warnings"].values.tolist(), strict=True):
        with warnings.catch_warnings(record=True) as reported:
            warnings.simplefilter("always")
            one = estimate(
                make_record(np.arange(row.size) / 100.0, row, "displacement"), SYSTEM, method=method
            )
        texts = " ".join([*one.notes, *(str(each.message) for each in reported)])
        assert {name for name, text in SAID.items() if text in texts} == names_of(bits)


@pytest.mark.parametrize(
    ("method", "prior"),
    [
        ("waveform", {"coefficient_precision": 3.0, "alpha": 4.0}),
        ("envelope", {"coefficient_precision": 3.0, "alpha": 4.0}),
        ("normal-gamma", {"mu": 0.3, "lam": 5.0, "alpha": 2.0, "beta": 0.1}),
        ("gamma-exponential", {"alpha": 3.0, "kappa": 0.5}),
    ],
)
def test_same_prior_and_peaks_as_estimate(method: str, prior: dict[str, float]) -> None:
    values = records("displacement", 2)
    many = plain_batch(values, SYSTEM, sampling_rate=RATE, method=method, prior=prior, peaks="nominal")
    for k, row in enumerate(values):
        record = make_record(np.arange(row.size) / RATE, row, "displacement")
        assert_same(many, k, plain(record, SYSTEM, method=method, prior=prior, peaks="nominal"))


@pytest.mark.parametrize("quantity", ["angle", "angular_velocity"])
@pytest.mark.parametrize("method", METHODS[1:])
def test_same_numbers_for_a_pendulum(quantity: str, method: str) -> None:
    system = Pendulum(inertia=0.02, stiffness=2.0, inertia_sd=0.001)
    signal = simulate(
        system,
        friction=0.004,
        initial_displacement=0.9,
        duration=6.0,
        sampling_rate=RATE,
        quantity=quantity,
        noise_sd=1e-3,
        seed=3,
    )
    many = plain_batch(
        np.stack([signal.values] * 2), system, sampling_rate=RATE, quantity=quantity, method=method
    )
    assert_same(many, 1, plain(signal, system, method=method))


def test_uncalibrated_pendulum_is_taken_as_small_swings() -> None:
    values = records("displacement", 1)
    system = Pendulum(inertia=0.02, stiffness=2.0)
    stack = xr.DataArray(values, dims=("record", "time"), attrs={"quantity": "angle", "units": "V"})
    for method in METHODS:
        many = plain_batch(stack, system, sampling_rate=RATE, method=method)
        one = plain(
            make_record(np.arange(values.shape[1]) / RATE, values[0], "angle", unit="V"),
            system,
            method=method,
        )
        assert_same(many, 0, one)
        assert many["friction_mean"].attrs["units"] == "V"


# What some methods cannot use, which of them can, what the others say of it, and its status.
HARD: dict[str, tuple[slice, set[str], str, str]] = {
    "short": (slice(240), {"waveform", "envelope"}, "a friction sample takes two amplitudes", "no_fit"),
    "growing": (slice(None, None, -1), set(), "no loss of amplitude shows", "not_decaying"),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", HARD)
def test_what_estimate_refuses_has_a_status(kind: str, method: str) -> None:
    part, able, refusal, status = HARD[kind]
    rows = records("displacement", 2)[:, part].copy()
    result = plain_batch(rows, SYSTEM, sampling_rate=RATE, method=method)
    for k, row in enumerate(rows):
        record = make_record(np.arange(row.size) / RATE, row, "displacement")
        if method in able:
            assert result["status"][k] == 0
            assert_same(result, k, plain(record, SYSTEM, method=method))
        else:
            with pytest.raises(InputError, match=refusal):
                estimate(record, SYSTEM, method=method)
            assert STATUS[int(result["status"][k])] == status
            assert np.isnan(result["friction_mean"][k])


def test_bad_records_are_flagged() -> None:
    values = records("displacement", 7)
    values[1, 500] = np.nan
    values[2] = 0.25
    values[3] = np.random.default_rng(1).standard_normal(values.shape[1])
    values[4] = np.clip(values[4], -0.005, 0.005)
    time = np.arange(values.shape[1]) / RATE
    values[6] = 0.01 * (np.cos(10.0 * time) + np.cos(14.0 * time)) * np.exp(-0.1 * time)
    result = estimate_batch(values, SYSTEM, sampling_rate=RATE)
    names = result["status"].attrs["flag_meanings"].split()
    assert tuple(names) == STATUS
    reported = [names[code] for code in result["status"].values]
    assert reported == ["ok", "not_finite", "constant", "no_oscillation", "clipped", "ok", "several_modes"]
    usable = result["status"].values == 0
    for name in ("friction_mean", "friction_sd", "noise_sd", "frequency"):
        np.testing.assert_array_equal(np.isfinite(result[name].values), usable)
    short = estimate_batch(values[:1, :80], SYSTEM, sampling_rate=RATE)
    assert names[int(short["status"][0])] == "too_short"


@pytest.mark.parametrize("method", METHODS)
def test_dask_stays_lazy_and_agrees(method: str) -> None:
    values = records("displacement", 5)
    with dask.config.set(scheduler=lambda *_, **__: pytest.fail("something was computed")):
        lazy = estimate_batch(
            da.from_array(values, chunks=(2, 400)), SYSTEM, sampling_rate=RATE, method=method
        )
    assert all(lazy[name].chunks is not None for name in lazy.data_vars)
    expected = estimate_batch(values, SYSTEM, sampling_rate=RATE, method=method)
    xr.testing.assert_allclose(lazy.compute(), expected, rtol=1e-12)


def test_dask_arrays_of_unknown_size_are_refused() -> None:
    array = da.from_array(records("displacement", 4), chunks=(2, 400))
    kept = array[array[:, 0] > -np.inf]
    with pytest.raises(InputError, match=r"shape \(nan, \d+\); call compute_chunk_sizes"):
        estimate_batch(kept, SYSTEM, sampling_rate=RATE)


def test_labelled_records_bring_clock_and_quantity() -> None:
    values = records("velocity", 2)
    labelled = xr.DataArray(
        values.T,
        dims=("time", "unit"),
        coords={"time": np.arange(values.shape[1]) / RATE, "unit": ["left", "right"]},
        attrs={"quantity": "velocity", "units": "m/s"},
    )
    result = estimate_batch(labelled, SYSTEM)
    expected = estimate_batch(values, SYSTEM, sampling_rate=RATE, quantity="velocity")
    np.testing.assert_allclose(result["friction_mean"], expected["friction_mean"], rtol=1e-9)
    assert list(result["record"].values) == ["left", "right"]
    assert result.attrs["quantity"] == "velocity"


@pytest.mark.parametrize("relative_sd", [1e-4, 0.01, 0.2])
@pytest.mark.parametrize("location", [5.0, -5.0, 0.1])
def test_product_with_uncertain_factor(relative_sd: float, location: float) -> None:
    scale, degrees, factor = 0.05, 30.0, 3.0
    one = scaled(stats.t(degrees, location, scale), factor, relative_sd=relative_sd)
    arrays = [np.array([value, np.nan]) for value in (location, scale, degrees)]
    for q in (0.05, 0.95):
        quantile = scaled_quantiles(stats.t, (arrays[2], *arrays[:2]), factor, relative_sd, q)
        assert quantile[0] == pytest.approx(float(one.ppf(q)), rel=1e-9)
        assert np.isnan(quantile[1])
    sd = np.array([stats.t(degrees, location, scale).std()])
    mean, spread = scaled_moments(np.array([location]), sd, factor, relative_sd)
    assert mean[0] == pytest.approx(one.mean(), rel=1e-12)
    assert spread[0] == pytest.approx(one.std(), rel=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"method": "gibbs"}, "method: unknown method 'gibbs'; give one of waveform, envelope"),
        ({"peaks": "lowest"}, "peaks: unknown choice 'lowest'"),
        ({"prior": {"coefficient_precision": -1.0}}, "coefficient_precision: -1 is too small for waveform"),
        ({"sampling_rate": None}, "sampling_rate: missing"),
        ({"quantity": "angle"}, "quantity: angle of the other kind of system"),
        (
            {"system": Pendulum(inertia=1.0, stiffness=1.0), "quantity": "angle"},
            "system: waveform integrates",
        ),
        ({"records": np.zeros(30)}, r"records: shape \(30,\)"),
        ({"records": np.array([["a", "b"]])}, "records: data type"),
        ({"prior": {"gamma": 1.0}}, "unknown key 'gamma'"),
    ],
)
def test_refusals(change: dict, message: str) -> None:
    arguments = {"records": np.zeros((2, 30)), "system": SYSTEM, "sampling_rate": RATE} | change
    with pytest.raises(InputError, match=message):
        estimate_batch(arguments.pop("records"), arguments.pop("system"), **arguments)


def test_records_that_are_not_white_are_averaged_over_accounts_as_one_record_is(rng) -> None:
    """Those that are keep the numbers of the first pass."""
    values = records("displacement", 3)
    forced = simulate(
        SYSTEM,
        friction=0.2,
        initial_displacement=0.011,
        duration=9.0,
        sampling_rate=RATE,
        seed=3,
        effects={"random_force.sd": 0.1, "random_force.correlation_time": 0.2},
    ).values
    values[1] = forced + 0.02 * forced.std() * rng.standard_normal(forced.size)
    result = estimate_batch(values, SYSTEM, sampling_rate=RATE)
    first = plain_batch(values, SYSTEM, sampling_rate=RATE)
    assert set(result) - set(first) == {"random_force_probability", "random_force_sd"}
    examined = np.isfinite(result["random_force_probability"].values)
    assert examined.tolist() == [False, True, False]
    for name in first:
        np.testing.assert_array_equal(result[name][[0, 2]], first[name][[0, 2]])
    one = estimate(make_record(np.arange(values.shape[1]) / RATE, values[1], "displacement"), SYSTEM)
    assert_same(result, 1, one)
    assert one.random_force is not None
    assert one.random_force.probability > 0.99
    assert result["random_force_probability"][1] == pytest.approx(one.random_force.probability)
    assert result["random_force_sd"][1] == pytest.approx(one.random_force.sd.mean())
    assert result["friction_sd"][1] > 3.0 * first["friction_sd"][1]
    assert result["random_force_sd"].attrs["units"] == "N"
    with pytest.raises(InputError, match="random_force"):
        estimate_batch(values, SYSTEM, sampling_rate=RATE, random_force="some")


def driven_decay() -> xr.DataArray:
    """A decay after five seconds of steady motion."""
    decay = long_decay(sampling_rate=100.0, noise_sd=0.0, seed=4).values
    steady = decay[0] * np.cos(0.1 * np.arange(-500, 0))
    values = np.concatenate([steady, decay]) + 1e-4 * np.random.default_rng(4).standard_normal(
        500 + decay.size
    )
    return make_record(np.arange(values.size) / 100.0, values, "displacement")


DOUBTS = {
    "none": (long_decay(sampling_rate=100.0, noise_sd=1e-4, seed=1), set()),
    "damping": (
        long_decay(
            sampling_rate=100.0, noise_sd=1e-4, seed=2, effects={"viscous_damping.damping_ratio": 0.004}
        ),
        {"uneven_loss"},
    ),
    "hand against": (pushed_decay(push=-3.0), {"disturbed_release"}),
    "drive": (driven_decay(), {"driven_before"}),
    "held": (long_decay(sampling_rate=100.0, noise_sd=1e-4, seed=4), {"held_readings"}),
    "stray sample": (long_decay(sampling_rate=100.0, noise_sd=1e-4, seed=3), {"samples_set_aside"}),
}
"""Records of which ``estimate`` says something before or next to the number, and which warnings these are."""
SAID = {
    "uneven_loss": "falls faster while it is larger",
    "later_start": "it does not fit the rest",
    "disturbed_release": "the release was still disturbed",
    "driven_before": "no amplitude was lost up to",
    "samples_set_aside": "set aside as outliers",
    "frequency": "standard deviations apart",
    "held_readings": "repeat the one before while the motion goes on",
    "taken_out": "is taken out",
}


def doubtful() -> np.ndarray:
    rows = np.array([record.values[:1200] for record, _ in DOUBTS.values()])
    rows[-1, 700] += 1.0
    rows[-2] = rows[-2, ::2].repeat(2)
    return rows


def names_of(bits: int) -> set[str]:
    return {name for i, name in enumerate(WARNINGS) if bits & (1 << i)}


@pytest.mark.parametrize("random_force", ["auto", "none"])
def test_what_estimate_says_has_its_bit_and_is_counted_once(random_force: str) -> None:
    values = doubtful()
    with pytest.warns(RecordWarning) as said:
        result = estimate_batch(values, SYSTEM, sampling_rate=100.0, random_force=random_force)
    (summary,) = said
    assert str(summary.message).startswith("5 of 6 records have warnings (samples leap out of the motion and")
    assert "the amplitude falls faster or slower while it is larger: 1" in str(summary.message)
    assert summary.filename == __file__
    assert result["warnings"].attrs["flag_meanings"].split() == list(WARNINGS)
    assert result["warnings"].attrs["flag_masks"].tolist() == [1 << i for i in range(len(WARNINGS))]
    found = [names_of(bits) for bits in result["warnings"].values.tolist()]
    # the start may be moved on where a random force is looked for
    assert [names - {"later_start"} for names in found] == [names for _, names in DOUBTS.values()]
    for row, names in zip(values, found, strict=True):
        with warnings.catch_warnings(record=True) as reported:
            warnings.simplefilter("always")
            one = estimate(
                make_record(np.arange(row.size) / 100.0, row, "displacement"),
                SYSTEM,
                random_force=random_force,
            )
        texts = " ".join([*one.notes, *(str(each.message) for each in reported)])
        assert {name for name, text in SAID.items() if text in texts} == names


def test_a_frequency_far_from_the_declared_one_has_its_bit() -> None:
    wrong = Oscillator(mass=13.0, stiffness=1000.0)
    with pytest.warns(RecordWarning, match="2 of 2 records .*the frequency is far from the declared one: 2"):
        result = estimate_batch(doubtful()[:1].repeat(2, axis=0), wrong, sampling_rate=100.0)
    assert [names_of(bits) for bits in result["warnings"].values.tolist()] == [{"frequency"}] * 2


def test_nothing_is_judged_where_it_is_not_asked_for_and_dask_stays_silent() -> None:
    values = doubtful()[1:2]
    plain_numbers = estimate_batch(values, SYSTEM, sampling_rate=100.0, judge=False)
    assert "warnings" not in plain_numbers
    lazy = estimate_batch(da.from_array(values, chunks=(1, 400)), SYSTEM, sampling_rate=100.0).compute()
    assert names_of(int(lazy["warnings"][0])) == {"uneven_loss"}
    xr.testing.assert_allclose(lazy.drop_vars("warnings"), plain_numbers, rtol=1e-12)


def test_a_record_of_which_no_decay_is_left_is_refused_without_the_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where what is free of it is too short to fit."""
    amplitude = 1.53e-3
    free = simulate(
        SYSTEM,
        friction=0.3,
        initial_displacement=amplitude,
        duration=6.0,
        sampling_rate=100.0,
        noise_sd=0.01 * amplitude,
        seed=30,
    ).values
    hold = amplitude * (1.0 + 0.01 * np.random.default_rng(81).standard_normal(85))
    stopped = np.concatenate([hold, free])
    other = long_decay(sampling_rate=100.0, noise_sd=1e-4, seed=1).values[: stopped.size]

    def statuses() -> list[str]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RecordWarning)
            result = estimate_batch([stopped, other], SYSTEM, sampling_rate=100.0)
        return [STATUS[code] for code in result["status"].values.tolist()]

    def refused(*_: object) -> None:
        raise InputError("record", "is too short", "give more")

    assert statuses() == ["ok", "ok"]
    monkeypatch.setattr(batch, "free_part", refused)
    assert statuses() == ["no_fit", "ok"]


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_dropouts_are_left_out_of_the_fit_as_of_one_record(quantity: str) -> None:
    """Their replacements look like samples without noise, and would count far more than they know."""
    rows = []
    for seed in (1, 2):
        row = long_decay(sampling_rate=100.0, noise_sd=1e-6, seed=seed, quantity=quantity).values.copy()
        for first in (150, 480, 811):
            row[first : first + 10] = row[first + 100 * seed]
        rows.append(row)
    with pytest.warns(RecordWarning, match="set aside: 2"):
        many = plain_batch(rows, SYSTEM, sampling_rate=100.0, quantity=quantity)
    for k, row in enumerate(rows):
        record = make_record(np.arange(row.size) / 100.0, row, quantity)
        with pytest.warns(RecordWarning, match="dropouts"):
            assert_same(many, k, plain(record, SYSTEM))


def test_dead_machines_are_no_turned_array() -> None:
    """A zero that swings from record to record looks like a decay across them."""
    point = np.arange(150)
    swing = 1e-3 * np.exp(-point / 60.0) * np.cos(2.0 * np.pi * point / 40.0)
    time = np.arange(400) / 100.0
    values = swing[:, None] + 1e-5 * np.random.default_rng(1).standard_normal((150, 400))
    values[:20] = long_decay(sampling_rate=100.0, noise_sd=1e-4, seed=1).values[:400]
    named = xr.DataArray(values, dims=("record", "time"), coords={"time": time})
    for labelled in (named, pd.DataFrame(values.T, index=time)):
        result = estimate_batch(labelled, SYSTEM, random_force="none", judge=False)
        assert (result["status"].values == 0).tolist() == [True] * 20 + [False] * 130
    with pytest.raises(InputError, match="of the columns"):
        estimate_batch(values, SYSTEM, sampling_rate=100.0, random_force="none", judge=False)


def test_tops_flat_below_noise_are_clipped_with_a_random_force_and_without() -> None:
    values = long_decay(sampling_rate=100.0, noise_sd=0.0, seed=1).values
    noise = 1e-4 * np.random.default_rng(1).standard_normal(values.size)
    values = np.clip(values, -0.045, 0.045) + noise
    for random_force in ("auto", "none"):
        result = estimate_batch(values[None], SYSTEM, sampling_rate=100.0, random_force=random_force)
        assert STATUS[int(result["status"][0])] == "clipped"
        assert result["warnings"].values.tolist() == [0]


def test_records_begin_anywhere_with_their_own_offset_and_as_any_number(rng: np.random.Generator) -> None:
    decay = long_decay(sampling_rate=100.0, noise_sd=1e-4, seed=5).values
    rows = [decay[k : k + 1000] + rng.uniform(-0.1, 0.1) for k in rng.integers(60, size=4)]
    counts = np.round(np.array(rows) / 1e-5).astype(np.int32)
    single = (1e-5 * counts).astype(np.float32)
    for given, unit in ((counts, 1.0), (single, 1e5), (np.asfortranarray(1e-5 * counts), 1e5)):
        many = plain_batch(given, SYSTEM, sampling_rate=100.0)
        for k, row in enumerate(given):
            one = plain(make_record(np.arange(1000) / 100.0, np.float64(row), "displacement"), SYSTEM)
            assert unit * many["friction_mean"][k] == pytest.approx(unit * one.friction.mean(), rel=1e-10)
            assert many["rest_position"][k] == pytest.approx(one.rest_position, rel=1e-10)


@pytest.mark.parametrize(
    "kind",
    [
        np.asarray,
        np.ndarray.tolist,
        partial(xr.DataArray, dims=("record", "time")),
        lambda turned: pd.DataFrame(turned.T),
        da.from_array,
        partial(da.from_array, chunks=(500, 2)),
    ],
    ids=["NumPy", "lists", "names exchanged", "a row a record", "Dask", "Dask in parts"],
)
@pytest.mark.parametrize("count", [3, 1])
def test_records_and_samples_the_wrong_way_round_are_refused(
    kind: Callable[[np.ndarray], Any], count: int
) -> None:
    turned = kind(records("displacement", count).T)
    with pytest.raises(
        InputError, match=r"0 % of the rows hold a decay, and (100|67) % of the columns; give \(rec"
    ):
        plain_batch(turned, SYSTEM, sampling_rate=RATE).compute()


def test_rows_without_a_decay_whose_columns_hold_none_either_are_flagged(rng: np.random.Generator) -> None:
    found = plain_batch(rng.standard_normal((1000, 800)), SYSTEM, sampling_rate=RATE)
    assert (found["status"] != STATUS.index("ok")).all()


DAYS = np.datetime64("2024-03-01T23:59:58", "ns")


@pytest.mark.parametrize(
    "kind",
    [
        lambda values, time: xr.DataArray(values.T, dims=("time", "machine"), coords={"time": time}),
        lambda values, time: xr.DataArray(
            values, dims=("record", "time"), coords={"time": DAYS + (1e9 * time).astype("m8[ns]")}
        ),
        lambda values, time: pd.DataFrame(values.T, index=time),
        lambda values, time: pd.DataFrame(values, columns=time, index=["a", "b", "c"]),
        lambda values, time: pd.DataFrame(values.T, index=pd.to_timedelta(time, unit="s")),
        lambda values, time: [make_record(time, row, "displacement") for row in values],
    ],
    ids=["time first", "dates", "DataFrame", "DataFrame, a row a record", "time differences", "records"],
)
def test_records_with_times_need_no_sampling_rate(kind: Callable[..., Any]) -> None:
    values = records("displacement", 3)
    found = plain_batch(kind(values, np.arange(values.shape[1]) / RATE), SYSTEM)
    expected = plain_batch(values, SYSTEM, sampling_rate=RATE)["friction_mean"]
    np.testing.assert_allclose(found["friction_mean"], expected, rtol=1e-9)


def test_masked_samples_are_missing() -> None:
    values = np.ma.masked_array(records("displacement", 2))
    values[1, 7] = np.ma.masked
    found = plain_batch(values, SYSTEM, sampling_rate=RATE)
    np.testing.assert_array_equal(found["status"], [STATUS.index("ok"), STATUS.index("not_finite")])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            xr.DataArray(np.ones((2, 900)), dims=("record", "time"), attrs={"units": "mm"}),
            r"'mm'; convert it to m",
        ),
        (
            xr.Dataset({"x": (("record", "time"), np.ones((2, 900)))}),
            "a Dataset; give the one of its variables",
        ),
        ([np.ones(900), np.ones(899)], "not of one length"),
        (np.ones((2, 0)), r"shape \(2, 0\)"),
        (
            [short_decay(duration=d) for d in (5.0, 4.0)],
            r"records\[1\]",
        ),
    ],
    ids=["millimetres", "Dataset", "lengths", "empty", "two clocks"],
)
def test_what_is_no_batch_is_refused(given: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        plain_batch(given, SYSTEM, sampling_rate=RATE)
