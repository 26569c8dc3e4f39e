"""Several records evaluated together along their motions: what they share, and friction that differs."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr
from scipy.signal import lfilter

import friction_bayes as fb
from decays import SYSTEM, fluctuating_friction, short_decay, slow_decay
from friction_bayes.core.errors import InputError
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer import law_fit
from friction_bayes.loop.infer.finer_columns import finer_shapes
from friction_bayes.plotting.loop import plot_friction_between_records
from friction_bayes.report.story import loop_story
from loop_options import loop_options

EFFECTS = ["viscous_damping", "stribeck_friction", "sensor_offset", "random_force"]


def releases(*frictions: float, offset: float = 0.0):  # type: ignore[no-untyped-def]
    """Decays released from one place, each with a friction of its own; the last sensor is off its zero."""
    return [
        slow_decay(
            friction=friction,
            duration=12.0,
            sampling_rate=100.0,
            seed=k,
            effects={"sensor_offset.offset": offset} if k == len(frictions) - 1 else {},
        ).assign_attrs(name=f"release-{k}")
        for k, friction in enumerate(frictions)
    ]


@pytest.fixture(scope="module")
def report() -> fb.LoopReport:
    return fb.close_loop(releases(0.0665, 0.0735, offset=2e-3), SYSTEM, seed=1, effects=EFFECTS)


def test_frictions_that_differ_are_no_law(report: fb.LoopReport) -> None:
    between = report.friction_between_records
    assert between is not None
    assert between["probability"] > 0.99
    assert 0.03 < between["share_of_friction"] < 0.3
    assert between["reduced_chi_square"] > 4.0
    assert report.candidates[0]["effects"] == ["sensor_offset"]
    for record, truth in zip(between["records"], (0.0665, 0.0735), strict=True):
        assert record["friction"]["mean"] == pytest.approx(truth, abs=4.0 * record["friction"]["sd"])
        # a damping too slight to show may move either, and moves both alike
        assert record["friction"]["sd"] < 0.0735 - 0.0665
    draws = report.posterior["posterior"]
    assert float((draws["friction[1]"] - draws["friction[0]"]).std()) < (0.0735 - 0.0665) / 10.0
    low, high = report.friction_after["interval90"]
    assert low < 0.07 < high
    assert report.friction_after["sd"] > 2.0 * between["records"][0]["friction"]["sd"]


def test_each_record_has_start_sensor_and_trace_of_its_own(report: fb.LoopReport) -> None:
    offsets = report.effects[0]["parameters"]
    assert abs(offsets["offset[0]"]["mean"]) < 5.0 * offsets["offset[0]"]["sd"]
    assert offsets["offset[1]"]["mean"] == pytest.approx(2e-3, abs=5.0 * offsets["offset[1]"]["sd"])
    assert {"displacement[1]", "velocity[0]", "friction[1]"} <= set(report.posterior["posterior"].data_vars)
    for trace in report.traces:
        assert np.sqrt(np.mean((trace.signal - trace.after) ** 2)) == pytest.approx(2e-4, rel=0.1)
    assert sum(c["probability"] for c in report.candidates) == pytest.approx(1.0)


def test_contradiction_is_said_and_drawn(report: fb.LoopReport) -> None:
    assert report.verdict == "unexplained"
    assert report.because == ("records",)
    reported = dict(loop_story(report.to_dict(), 2))
    assert "contradict each other: friction is 0.0" in reported["verdict"]
    assert "in release-0" in reported["verdict"]
    assert "N in release-1, " in reported["verdict"]
    assert "release-1   0.07" in reported["between records"]
    assert "--varying-friction" in reported["next experiment"]
    labels = [text.get_text() for text in plot_friction_between_records(report).axes[0].get_yticklabels()]
    assert labels == ["release-0", "release-1", "mean"]


@cache
def of_one_friction() -> fb.LoopReport:
    return fb.close_loop(releases(0.07, 0.07), SYSTEM, seed=1, effects=EFFECTS)


def test_one_friction_stays_one() -> None:
    found = of_one_friction()
    between = found.friction_between_records
    assert between is not None
    assert between["probability"] < 0.6
    assert between["reduced_chi_square"] < 4.0
    low, high = found.friction_after["interval90"]
    assert low < 0.07 < high
    # the few half cycles leave Stribeck friction 6 %, and with it another friction
    assert found.candidates[0]["effects"] == []
    assert found.verdict in {"adequate", "ambiguous"}
    assert "contradict" not in dict(loop_story(found.to_dict(), 2))["verdict"]


def far_apart(unsteady: bool) -> list[xr.DataArray]:
    return [
        slow_decay(
            friction=friction,
            duration=12.0,
            sampling_rate=100.0,
            seed=20 + k,
            effects=fluctuating_friction() if unsteady else {},
        )
        for k, friction in enumerate((0.07, 0.098))
    ]


@pytest.mark.parametrize("unsteady", [False, True])
def test_frictions_far_apart_contradict_each_other(unsteady: bool) -> None:
    found = fb.close_loop(far_apart(unsteady), SYSTEM, seed=1, effects=EFFECTS)
    assert found.verdict == "unexplained"
    assert "records" in found.because
    between = found.friction_between_records
    assert between is not None
    for record, truth in zip(between["records"], (0.07, 0.098), strict=True):
        assert record["friction"]["mean"] == pytest.approx(truth, abs=4.0 * record["friction"]["sd"])


@pytest.mark.parametrize("unsteady", [False, True])
def test_frictions_that_are_known_to_vary_contradict_nothing(unsteady: bool) -> None:
    offered = ["viscous_damping", "random_force"][: 1 + unsteady]
    found = fb.close_loop(far_apart(unsteady), SYSTEM, seed=1, effects=offered, varying_friction=True)
    assert "records" not in found.because
    between = found.friction_between_records
    assert between is not None
    assert between["probability"] == pytest.approx(1.0)
    assert (found.random_force is not None) == unsteady


@pytest.mark.parametrize(
    ("records", "options", "problem"),
    [
        (1, {}, "one record"),
    ],
)
def test_what_it_does_not_go_with_is_refused(records: int, options: dict, problem: str) -> None:
    with pytest.raises(InputError, match=f"varying_friction.*{problem}"):
        fb.close_loop(
            releases(*[0.07] * records), SYSTEM, seed=1, effects=EFFECTS, varying_friction=True, **options
        )


def test_records_of_coloured_sensors_are_evaluated_together() -> None:
    rng, noisy = np.random.default_rng(1), releases(0.07, 0.07)
    for record in noisy:
        record.values[:] += lfilter([1e-3], [1.0, -0.9], rng.standard_normal(record.size))
    found = fb.close_loop(noisy, SYSTEM, seed=1, effects=["viscous_damping", "random_force"])
    assert found.noise["model"] == "ar"
    assert found.friction_between_records is not None


TRIED = ["viscous_damping", "random_force", "outliers", "sensor_clipping"]


def three_releases(unsteady: bool) -> list[xr.DataArray]:
    return [
        slow_decay(
            initial_displacement=0.0147 - 0.001 * k,
            duration=12.0,
            sampling_rate=100.0,
            seed=k,
            effects=fluctuating_friction() if unsteady else {},
        )
        for k in range(3)
    ]


@pytest.mark.parametrize("unsteady", [False, True])
def test_spoilt_records_spoil_no_other(unsteady: bool) -> None:
    """Spikes and clipped samples are set aside, each in their record; friction hardly moves."""
    records = three_releases(unsteady)
    whole = fb.close_loop(records, SYSTEM, seed=1, effects=TRIED)
    rng, fitted = np.random.default_rng(1), list[str]()
    _, spiked, clipped = (record.values for record in records)
    spiked[rng.choice(spiked.size, 20, replace=False)] += 5e-3 * rng.standard_normal(20)
    clipped[:] = np.clip(clipped, -0.0105, 0.0105)
    found = fb.close_loop(records, SYSTEM, seed=1, effects=TRIED, progress=fitted.append)
    assert "Coulomb friction alone" not in fitted
    assert "left_over" not in found.because
    assert found.friction_between_records is not None
    faults = {"outliers": "[1]", "sensor_clipping": "[2]"}
    assert set(found.candidates[0]["effects"]) == {*whole.candidates[0]["effects"], *faults}
    for effect in found.effects:
        if effect["name"] in faults:
            assert effect["parameters"]
            assert all(name.endswith(faults[effect["name"]]) for name in effect["parameters"])
    sd = whole.friction_after["sd"]
    assert found.friction_after["mean"] == pytest.approx(whole.friction_after["mean"], abs=0.7 * sd)
    assert found.friction_after["sd"] == pytest.approx(sd, rel=0.5)
    assert found.held_out_error["noise_floor"] < 3.0 * whole.held_out_error["noise_floor"]


def test_what_is_improbable_is_evaluated_in_several_records_too() -> None:
    tried = [*EFFECTS, "presliding", "sensor_hysteresis"]
    found = fb.close_loop(releases(0.07, 0.07), SYSTEM, seed=1, effects=tried)
    for name in ("random_force", "presliding", "sensor_hysteresis"):
        assert 0.0 < sum(c["probability"] for c in found.candidates if name in c["effects"]) < 0.5
    assert found.random_force is not None
    assert all(trace.fluctuation is None for trace in found.traces)
    assert found.friction_between_records is not None


def test_a_measured_force_is_compared_with_several_records() -> None:
    first, second = releases(0.07, 0.07)
    force = np.full(first.size, 0.07)
    found = fb.close_loop([first, second], SYSTEM, seed=1, effects=EFFECTS, reference_force=force)
    assert found.friction_after == of_one_friction().friction_after
    assert "force" in found.residual
    assert found.traces[0].forces is not None
    assert found.traces[1].forces is None


def test_the_next_experiment_is_named_for_several_records() -> None:
    """Two releases from one place do not separate two drags; one from another place would."""
    records = [
        slow_decay(
            duration=10.0,
            sampling_rate=50.0,
            noise_sd=1e-5,
            seed=3 + k,
            effects=fluctuating_friction() | {"viscous_damping.damping_ratio": 0.003},
        )
        for k in range(2)
    ]
    tried = ["viscous_damping", "quadratic_drag", "random_force"]
    found = fb.close_loop(records, SYSTEM, seed=1, effects=tried)
    assert found.friction_between_records is not None
    assert found.verdict == "ambiguous"
    assert found.next_experiment is not None
    assert "random force from" in found.next_experiment


def test_a_drift_of_friction_is_each_records_own() -> None:
    changes = (0.5, -0.5)
    records = [
        slow_decay(
            duration=12.0,
            sampling_rate=100.0,
            noise_sd=5e-5,
            seed=k,
            effects={"friction_drift.relative_change": change},
        )
        for k, change in enumerate(changes)
    ]
    for options in ({}, {"random_force": "none"}):
        found = fb.close_loop(records, SYSTEM, seed=1, effects=["friction_drift", "random_force"], **options)
        assert found.candidates[0]["effects"] == ["friction_drift"]
        parameters = found.effects[0]["parameters"]
        assert set(parameters) == {"relative_change[0]", "relative_change[1]"}
        for k, change in enumerate(changes):
            one = parameters[f"relative_change[{k}]"]
            assert one["mean"] == pytest.approx(change, abs=4.0 * one["sd"])
            assert one["sd"] < 0.2


def test_a_shared_effect_that_differs_is_a_contradiction(report: fb.LoopReport) -> None:
    """Friction may differ between releases, damping may not: nothing else would show it."""
    damped = [
        slow_decay(
            friction=0.07,
            duration=14.0,
            sampling_rate=100.0,
            noise_sd=1e-4,
            seed=k,
            effects={"viscous_damping.damping_ratio": ratio},
        ).assign_attrs(name=f"oil-{k}")
        for k, ratio in enumerate((1.5e-3, 3.8e-3))
    ]
    found = fb.close_loop(damped, SYSTEM, seed=1, effects=EFFECTS)
    assert found.verdict == "unexplained"
    assert "records" in found.because
    reported = [note for note in found.notes if "one" in note]
    assert len(reported) == 1
    assert "contradict one viscous_damping for all" in reported[0]
    assert "oil-0 0." in reported[0]
    assert "oil-1 1." in reported[0]
    assert not any("contradict" in note for note in report.notes)


BENT = ["viscous_damping", "stribeck_friction", "presliding"]
STRIBECK = {"stribeck_friction.static_excess": 0.6, "stribeck_friction.stribeck_velocity": 0.03}
"""Four tenths of a prior standard deviation from the middle, between two values of the prior."""


def bent_releases(seed: int, effects: dict[str, float]) -> list[xr.DataArray]:
    return [
        short_decay(initial_displacement=0.02 - 0.004 * k, noise_sd=2e-5, seed=seed + k, effects=effects)
        for k in range(2)
    ]


@pytest.mark.parametrize(
    ("effect", "effects"),
    [("stribeck_friction", STRIBECK), ("presliding", {"presliding.displacement": 4e-4})],
)
def test_a_shape_between_the_values_of_its_prior_is_found_in_all_records(
    effect: str, effects: dict[str, float], seed: int
) -> None:
    found = fb.close_loop(bent_releases(seed, effects), SYSTEM, seed=1, effects=BENT)
    assert found.candidates[0]["effects"] == [effect]
    friction, (bent,) = found.friction_after, found.effects
    assert friction["mean"] == pytest.approx(0.5, abs=4.0 * friction["sd"])
    assert friction["sd"] < 0.02
    for name, parameter in bent["parameters"].items():
        assert parameter["mean"] == pytest.approx(effects[f"{effect}.{name}"], abs=4.0 * parameter["sd"])


def test_a_law_without_shapes_takes_two_rounds(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rounds, evaluated = [], law_fit._evaluated
    monkeypatch.setattr(law_fit, "_evaluated", lambda *a, **k: rounds.append(k) or evaluated(*a, **k))
    segments = cut_records(bent_releases(seed, {"viscous_damping.damping_ratio": 0.01}), SYSTEM)
    law_fit.fit_law(segments, SYSTEM, loop_options(BENT))
    first, last = rounds
    assert first["only_mode"]
    assert first["near"] is None
    assert not last["kept"].all()


def test_a_record_given_twice_determines_its_shape_by_the_root_of_two_better(seed: int) -> None:
    segments = cut_records(bent_releases(seed, STRIBECK)[:1], SYSTEM)
    (fit,) = law_fit.fit_law(segments, SYSTEM, loop_options(BENT)).fits
    once, twice = (
        finer_shapes(r * [fit], r * [fit.coefficients], r * [fit.posterior.best])["stribeck_friction"]
        for r in (1, 2)
    )
    step = once[1] - once[0]
    assert twice[1] - twice[0] == pytest.approx(step / np.sqrt(2.0), rel=0.01)
    assert twice[2] == pytest.approx(once[2], abs=0.5 * step)


def test_shapes_that_still_change_are_all_evaluated(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(law_fit, "_MOST_ROUNDS", 2)
    segments = cut_records(bent_releases(seed, STRIBECK), SYSTEM)
    fit = law_fit.fit_law(segments, SYSTEM, loop_options(BENT))
    assert fit.sets[fit.fits[0].chosen] == {"stribeck_friction"}
    shapes = {each.shape for each in fit.law.columns if each.effect == "stribeck_friction"}
    alone = [i for i, effects in enumerate(fit.sets) if effects == {"stribeck_friction"}]
    evaluated = fit.fits[0].regression.sets[np.intersect1d(alone, fit.problem.number)]
    columns = np.flatnonzero(evaluated.any(axis=0))
    assert {fit.law.columns[j].shape for j in columns} >= shapes
