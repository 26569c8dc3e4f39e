"""Detection points: tracking against a joint fit, the wear model against brute force, times and refusals."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy import integrate, stats

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.conjugate.regression import NormalInverseGamma
from friction_bayes.core.strict_json import strict_json
from friction_bayes.estimators.batch import STATUS
from friction_bayes.monitor.points import DetectionPoints, detection_times
from friction_bayes.monitor.remaining_life import remaining_life
from friction_bayes.monitor.report import follow
from friction_bayes.monitor.tracking import choose_discount, track
from friction_bayes.monitor.wear import WearPosterior, WearPrior, fit_wear

FRICTION = np.array([0.30, 0.34, 0.41, 0.43, 0.52])
SD = np.array([0.01, 0.02, 0.01, 0.03, 0.02])
TIMES = np.array([0.0, 1.0, 2.0, 4.0, 5.0])


def decay(friction: float, seed: int, **attributes: Any) -> xr.DataArray:
    record = short_decay(friction=friction, duration=4.0, seed=seed, name=f"run{seed}")
    return record.assign_attrs(attributes)


def test_nothing_forgotten_is_the_weighted_mean_of_all() -> None:
    followed = track(FRICTION, SD)
    weight = SD**-2.0
    assert followed.mean[-1] == pytest.approx(np.average(FRICTION, weights=weight), rel=1e-12)
    assert followed.sd[-1] == pytest.approx(weight.sum() ** -0.5, rel=1e-12)


def test_discount_multiplies_the_precision_of_the_prior() -> None:
    # the power of a normal density, and Bayes' rule, by quadrature
    followed = track(FRICTION[:2], SD[:2], 0.3)
    r = np.linspace(0.2, 0.5, 20_001)
    kernel = stats.norm.pdf(r, FRICTION[0], SD[0]) ** 0.3 * stats.norm.pdf(FRICTION[1], r, SD[1])
    kernel /= integrate.simpson(kernel, x=r)
    mean = integrate.simpson(r * kernel, x=r)
    sd = math.sqrt(integrate.simpson((r - mean) ** 2 * kernel, x=r))
    assert (followed.mean[1], followed.sd[1]) == pytest.approx((mean, sd), rel=1e-8)


def test_a_friction_that_stays_is_not_forgotten_and_one_that_wears_is(rng: np.random.Generator) -> None:
    sd = np.full(12, 1e-3)
    noise = 1e-3 * rng.standard_normal(12)
    # the chance that noise alone makes a discount below 1e-2 look better is far under 1e-4
    assert choose_discount(0.3 + noise, sd) > 1e-2
    wearing = 0.3 + 0.02 * np.arange(12) + noise
    discount = choose_discount(wearing, sd)
    assert discount < 0.02
    plain, forgetting = track(wearing, sd), track(wearing, sd, discount)
    assert forgetting.log_predictive > plain.log_predictive + 100.0
    # the mean of all lags by half of what was worn, many of its own standard deviations
    assert (wearing[-1] - plain.mean[-1]) / plain.sd[-1] > 50.0
    assert abs(wearing[-1] - forgetting.mean[-1]) < 3.0 * sd[-1]


def test_without_diffusion_and_scatter_wear_is_a_straight_line_fit() -> None:
    tiny = WearPrior(wander=1e-9, scatter=1e-9)
    wear = fit_wear(TIMES, FRICTION, SD, tiny)
    design = np.column_stack([np.ones(5), TIMES - TIMES[-1]]) / SD[:, None]
    covariance = np.linalg.inv(design.T @ design)
    expected = covariance @ design.T @ (FRICTION / SD)
    found = np.array([wear.weight @ wear.level, wear.weight @ wear.drift])
    np.testing.assert_allclose(found, expected, rtol=1e-8)
    spread = [wear.level_variance[0], wear.drift_variance[0], wear.covariance[0]]
    np.testing.assert_allclose(spread, covariance[[0, 1, 0], [0, 1, 1]], rtol=1e-6)


def test_drift_of_an_exactly_seen_path_is_the_conjugate_regression_of_its_steps() -> None:
    # increments over sqrt(dt) regressed on sqrt(dt); flat in sqrt(v), as a wide half-Cauchy is
    prior = WearPrior(wander=30.0, scatter=1e-9)
    wear = fit_wear(TIMES, FRICTION, np.full(5, 1e-9), prior)
    step = np.diff(TIMES)
    exact = NormalInverseGamma.from_prior(mean=[0.0], precision=0.0, alpha=-1.0, beta=0.0).update(
        np.sqrt(step)[:, None], np.diff(FRICTION) / np.sqrt(step)
    )
    drift = exact.marginal(0)
    spread = np.sqrt(wear.drift_variance)
    for q in (0.05, 0.5, 0.9):
        mixture = wear.weight @ stats.norm.cdf(drift.ppf(q), wear.drift, spread)
        assert mixture == pytest.approx(q, abs=2e-4)


def draws(wear: WearPosterior, threshold: float, n: int, rng: np.random.Generator) -> np.ndarray:
    """Remaining lives by simulation: drift and friction from the posterior, then the law of Wald."""
    k = rng.choice(wear.weight.size, n, p=wear.weight)
    z, y = rng.standard_normal((2, n))
    level_sd = np.sqrt(wear.level_variance[k])
    left = np.sqrt(np.maximum(wear.drift_variance[k] - (wear.covariance[k] / level_sd) ** 2, 0.0))
    drift = wear.drift[k] + wear.covariance[k] / level_sd * z + left * y
    distance = threshold - wear.level[k] - level_sd * z
    d = np.abs(distance)
    crosses = (drift > 0.0) | (rng.random(n) < np.exp(np.minimum(2.0 * drift * d / wear.wander[k] ** 2, 0.0)))
    life = np.where(crosses, rng.wald(d / np.abs(drift), (d / wear.wander[k]) ** 2), np.inf)
    return np.where(distance <= 0.0, 0.0, life)


@pytest.mark.parametrize("threshold", [0.5, 0.55, 0.9, 3.0])
def test_remaining_life_is_what_simulation_gives(threshold: float, rng: np.random.Generator) -> None:
    wear = fit_wear(TIMES, FRICTION, SD)
    life = remaining_life(wear, threshold, 5.0)
    n = 40_000
    simulated = draws(wear, threshold, n, rng)
    # 20 comparisons at five standard errors and the stated 2e-3: one run in 10^4 may fail by chance
    for probability in (0.05, 0.3, 0.5, 0.7, 0.95):
        time = life.ppf(probability)
        reached = np.mean(simulated <= time)
        expected = float(life.cdf(min(time, 1e12)))
        assert reached == pytest.approx(expected, abs=2e-3 + 5.0 * 0.5 / math.sqrt(n))
    assert life.already == pytest.approx(np.mean(simulated == 0.0), abs=2.5 / math.sqrt(n))
    assert life.never == pytest.approx(np.mean(np.isinf(simulated)), abs=2e-3 + 2.5 / math.sqrt(n))
    assert life.cumulative[-1] + life.never == pytest.approx(1.0)


@pytest.mark.parametrize("sd", [1e-6, 1e-9, 1e-12, 4e-17])
def test_records_without_noise_reach_the_threshold_where_their_line_does(sd: float) -> None:
    # rounding of the last digit, as the closed form of noise-free records leaves it
    friction = np.array([0.05, 0.06, 0.07, 0.08]) * (1.0 + np.array([1.0, -1.0, 2.0, 1.0]) * 2.0**-52)
    wear = fit_wear(np.arange(4.0), friction, np.full(4, sd))
    life = remaining_life(wear, 0.1, 3.0)
    assert life.never < 1e-3
    assert life.ppf(0.5) == pytest.approx(2.0, rel=1e-3)
    simulated = draws(wear, 0.1, 40_000, np.random.default_rng(1))
    for probability in (0.2, 0.8):
        # a time of 1e-4 of itself is resolved
        low, high = (life.ppf(probability) * (1.0 + d) for d in (-1e-4, 1e-4))
        assert np.mean(simulated <= low) - 0.02 < probability < np.mean(simulated <= high) + 0.02


def test_a_falling_friction_mostly_never_reaches_the_threshold() -> None:
    points = DetectionPoints(
        times=TIMES, time_unit="h", friction=FRICTION[::-1].copy(), sd=SD, unit="N", relative_sd=0.0
    )
    report = follow(points, 0.8)
    assert report.life is not None
    assert report.life.never > 0.5
    assert report.life.ppf(0.95) == math.inf
    assert report.advice()["case"] == "not_approaching"
    reported = json.loads(strict_json(report.to_dict()))["prognostic_assessment"]
    assert reported["remaining_life"]["interval90"][1] is None
    assert follow(points, 0.2).advice()["case"] == "threshold_passed"
    assert follow(points, None).advice()["case"] == "no_threshold"


def test_any_scale_of_time_friction_and_error_gives_a_distribution(rng: np.random.Generator) -> None:
    for _ in range(12):
        n = int(rng.integers(2, 9))
        friction = 10.0 ** rng.uniform(-6.0, 4.0) * (
            1.0 + 10.0 ** rng.uniform(-6.0, 0.5) * rng.normal(size=n)
        )
        size = float(np.abs(friction).max())
        points = DetectionPoints(
            times=np.sort(rng.uniform(0.0, 10.0 ** rng.uniform(-3.0, 6.0), n)),
            time_unit="h",
            friction=friction,
            sd=size * 10.0 ** rng.uniform(-12.0, 0.5) * np.exp(rng.normal(size=n)),
            unit="N",
            relative_sd=float(rng.choice([0.0, 0.01, 0.3])),
        )
        report = follow(points, size * 10.0 ** rng.uniform(-3.0, 3.0))
        life = report.life
        assert life is not None
        assert np.all(np.isfinite(life.density))
        assert np.all(np.diff(life.cumulative) >= 0.0)
        assert 0.0 <= life.already <= 1.0
        assert 0.0 <= life.never <= 1.0
        quantiles = [life.ppf(q) for q in (0.05, 0.5, 0.95)]
        assert quantiles == sorted(quantiles)
        json.loads(strict_json(report.to_dict()))


def test_uncertain_stiffness_widens_the_remaining_life_and_moves_nothing() -> None:
    wear = fit_wear(TIMES, 0.3 + 0.04 * TIMES, np.full(5, 1e-4))
    exact, wide = (remaining_life(wear, 0.9, 5.0, relative_sd=s) for s in (0.0, 0.1))
    assert wide.ppf(0.95) - wide.ppf(0.05) > 1.5 * (exact.ppf(0.95) - exact.ppf(0.05))
    assert wide.ppf(0.5) == pytest.approx(exact.ppf(0.5), rel=0.05)


def test_fleet_is_each_machine_by_itself() -> None:
    frictions = [(0.30, 0.34, 0.40), (0.30, 0.31, 0.33), (0.2, 0.3, 0.35)]
    machines = [[decay(f, 10 * k + i + 1) for i, f in enumerate(row)] for k, row in enumerate(frictions)]
    values = np.array([[record.values for record in row] for row in machines])
    values[1, 1], values[2, :2] = np.nan, np.nan
    times = ("run", [0.0, 50.0, 120.0], {"units": "h"})
    fleet = xr.DataArray(
        values,
        dims=("pump", "run", "time"),
        coords={"time": machines[0][0]["time"].values, "pump": ["a", "b", "c"], "detection_time": times},
        attrs={"quantity": "displacement", "units": "m"},
    )
    # mass and stiffness contradict the frequency of the records
    system = fb.Oscillator(mass=10.0, stiffness=1100.0, stiffness_sd=20.0)
    found = fb.monitor_fleet(fleet.chunk({"pump": 2}), system, threshold=0.6)
    with pytest.warns(fb.RecordWarning, match="standard deviations apart"):
        alone = fb.monitor_records(machines[0], system, threshold=0.6, times=[0, 50, 120], time_unit="h")
    assert alone.life is not None
    first = found.sel(machine="a")
    np.testing.assert_allclose(first["friction_mean"], alone.forgetting.mean, rtol=1e-9)
    np.testing.assert_allclose(first["plain_sd"], alone.plain.sd, rtol=1e-6)
    assert alone.points.relative_sd > 0.04
    np.testing.assert_allclose(first["relative_sd_of_factor"], alone.points.relative_sd, rtol=1e-9)
    life = [alone.life.ppf(q) for q in (0.05, 0.5, 0.95)]
    np.testing.assert_allclose(first["remaining_life"], life, rtol=1e-4)
    assert found["points_used"].values.tolist() == [3, 2, 1]
    assert found["status"].values.tolist() == [0, 0, 1]
    assert np.isnan(found["friction_mean"].values[1, 1])
    assert np.isnan(found["remaining_life"].sel(machine="c")).all()
    assert found["drift_mean"].attrs["units"] == "N/h"


def test_a_fleet_leaves_out_records_whose_tops_are_flat_below_noise() -> None:
    """As a machine by itself does: their friction would be a third of what it is."""
    whole = [decay(0.5, seed) for seed in (1, 2, 3)]
    flat = np.clip(whole[1].values, -0.012, 0.012) + 1e-4 * np.random.default_rng(1).standard_normal(400)
    values = np.array([whole[0].values, flat, whole[2].values])
    with pytest.raises(fb.InputError, match="saturates"):
        fb.monitor_records([whole[0], whole[1].copy(data=flat)], SYSTEM)
    fleet = xr.DataArray(
        values[None],
        dims=("machine", "point", "time"),
        coords={"time": whole[0]["time"].values},
        attrs={"quantity": "displacement", "units": "m"},
    )
    found = fb.monitor_fleet(fleet, SYSTEM)
    assert STATUS[int(found["record_status"][0, 1])] == "clipped"
    assert found["points_used"].values.tolist() == [2]


TIMES_GIVEN: dict[str, tuple[Sequence[Any] | None, list[dict[str, Any]], tuple[list[float], str]]] = {
    "order": (None, [{}, {}], ([1.0, 2.0], "detection points")),
    "numbers": ([3, "7.5"], [{}, {}], ([3.0, 7.5], "h")),
    "dates": (["2021-03-01", "2021-03-02T12:00"], [{}, {}], ([0.0, 1.5], "d")),
    "attributes": (
        None,
        [{"detection_time": t, "detection_time_units": "cycles"} for t in (1e6, 2e6)],
        ([1e6, 2e6], "cycles"),
    ),
    "dated attributes": (
        None,
        [{"detection_time": t} for t in ("2020-01-01", "2021-01-01")],
        ([0.0, 366.0], "d"),
    ),
}


@pytest.mark.parametrize("kind", TIMES_GIVEN)
def test_times_of_the_points(kind: str) -> None:
    times, attributes, expected = TIMES_GIVEN[kind]
    records = [decay(0.3, 1, **each) for each in attributes]
    found, unit, _ = detection_times(records, times, "h")
    assert (found.tolist(), unit) == expected


WRONG_TIMES: dict[str, tuple[Sequence[Any] | None, list[dict[str, Any]], str]] = {
    "one too few": ([1], [{}, {}], "1 for 2 records"),
    "backwards": ([5, 1], [{}, {}], "not after"),
    "equal": (["2021-03-01", "2021-03-01"], [{}, {}], "not after"),
    "mixed": ([5, "2021-03-01"], [{}, {}], "date among numbers"),
    "no such month": (["2021-13-01", "2021-03-01"], [{}, {}], "'2021-13-01' is not a number"),
    "words": (["soon", "later"], [{}, {}], "'soon' is not a number"),
    "not finite": ([1, math.nan], [{}, {}], "not finite"),
    "zones": (["2021-03-01T00:00+00:00", "2021-03-02"], [{}, {}], "time zone"),
    "one without": (None, [{"detection_time": 1.0}, {}], "has no attribute"),
    "two units": (
        None,
        [{"detection_time": t, "detection_time_units": u} for t, u in ((1.0, "h"), (2.0, "d"))],
        "differ: d, h",
    ),
}


@pytest.mark.parametrize("kind", WRONG_TIMES)
def test_wrong_times_are_refused(kind: str) -> None:
    times, attributes, said = WRONG_TIMES[kind]
    records = [decay(0.3, 1, **each) for each in attributes]
    with pytest.raises(fb.InputError, match=said):
        detection_times(records, times, None)


@pytest.mark.parametrize("threshold", [0.0, -1.0, math.nan, math.inf])
def test_a_threshold_is_a_positive_number(threshold: float) -> None:
    with pytest.raises(fb.InputError, match="threshold"):
        fb.monitor_records([decay(0.3, 1), decay(0.4, 2)], SYSTEM, threshold=threshold)
