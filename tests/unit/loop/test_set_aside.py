"""Outliers and clipped samples next to a force that fluctuates: what is set aside, and what it is worth."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import decays
import friction_bayes as fb
from evidence_without_force import log_evidence_without_force
from experiments.simulation.laplace_evidence import log_evidence
from experiments.simulation.simulated_fit import simulated_fit
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.record_fit import fit_random_force
from friction_bayes.loop.noise.likelihood import come_anywhere
from friction_bayes.statespace.smoother import SmoothedMotion
from unsteady_decays import FRICTION, RELEASE, STEP, SYSTEM, faulty_record, fitted

NOISE = 2e-4
CEILING = 0.6 * RELEASE
HIT, FAR = 0.02, 15.0
"""Share of outliers, and their size over that of the noise."""

decay = partial(faulty_record, noise=NOISE, far=FAR)


def test_what_is_set_aside_near_a_ceiling_does_not_follow_the_noise(rng: np.random.Generator) -> None:
    """Of samples that a noise of four deviations could take to the ceiling every one, of others none."""
    record, motion, _ = decay(rng, force=0.2, ceiling=CEILING)
    fit = fitted(record, ["random_force"])
    aside = np.isinf(fit.clock.variance)
    room = CEILING - np.abs(motion[: aside.size])
    assert aside[room < 3.5 * NOISE].all()
    assert not aside[room > 4.5 * NOISE].any()


def test_outliers_are_found_beside_a_force(rng: np.random.Generator) -> None:
    record, motion, far = decay(rng, force=0.2, hit=HIT)
    fit = fitted(record, ["random_force", "outliers"])
    noise = fit.sensor_noise
    assert noise.probabilities()[frozenset({"outliers"})] > 0.999
    assert noise.outliers is not None
    assert noise.outliers.fraction == pytest.approx(far.mean(), rel=0.4)
    assert noise.outliers.scale == pytest.approx(FAR * NOISE, rel=0.4)
    assert fit.posterior.noise_sd == pytest.approx(NOISE, rel=0.08)
    # a first sample that is one is before the decay
    start = round(fit.segment.decay.start_time / STEP)
    error = np.abs(fit.segment.values - motion[start : start + fit.segment.values.size])[: fit.record.samples]
    aside = np.isinf(fit.clock.variance)
    assert aside[error > 5.0 * NOISE].all()
    assert not aside[error < 2.5 * NOISE].any()


def test_outliers_are_found_beside_noise_that_grows(rng: np.random.Generator) -> None:
    record, _, far = decay(rng, force=0.2, hit=HIT, growing=3.0)
    fit = fitted(record, ["random_force", "outliers", "timing_jitter", "proportional_noise"])
    both = frozenset({"outliers", "proportional_noise"})
    assert fit.sensor_noise.effects == both
    assert fit.sensor_noise.probabilities()[both] > 0.99
    assert sum(fit.sensor_noise.probabilities().values()) == pytest.approx(1.0)
    assert fit.growth is not None
    share = fit.growth.ratio * fit.posterior.noise_sd
    assert share == pytest.approx(3.0 * NOISE / RELEASE, rel=0.3)
    assert fit.posterior.noise_sd == pytest.approx(NOISE, rel=0.1)
    assert np.isinf(fit.clock.variance)[far[: fit.record.samples]].mean() > 0.5


def test_values_at_jumps_of_the_acceleration_stay_set_aside(rng: np.random.Generator) -> None:
    """Next to outliers, and they are none themselves."""
    record, motion, far = decay(rng, force=0.0, hit=HIT, order=2)
    fit = fitted(record, ["random_force", "outliers"])
    at_jump = fit.segment.ignored[: fit.record.samples]
    aside = np.isinf(fit.clock.variance)
    assert aside[at_jump].all()
    error = np.abs(fit.segment.values - motion[: fit.segment.values.size])[: fit.record.samples]
    assert aside[error > 500.0 * NOISE].all()
    assert not aside[~at_jump & (error < 250.0 * NOISE)].any()
    assert fit.sensor_noise.outliers is not None
    assert fit.sensor_noise.outliers.fraction == pytest.approx(far.mean(), rel=0.4)


def test_what_comes_with_the_turning_points_is_no_outlier_of_the_sensor(rng: np.random.Generator) -> None:
    record, motion, _ = decay(rng, force=0.2)
    slow = np.abs(np.gradient(motion, STEP)) < 0.15 * 10.0 * RELEASE
    hit = slow & (rng.random(motion.size) < 0.2)
    off = np.where(hit, FAR * NOISE * rng.standard_normal(motion.size), 0.0)
    fit = fitted(record + off, ["random_force", "outliers"])
    assert np.isfinite(fit.clock.variance).all()


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (0.0, 0.3), (0.4, 0.5)])
def test_outliers_come_at_any_time(low: float, high: float, rng: np.random.Generator) -> None:
    n = 2000
    time = np.arange(n) / n
    motion = SmoothedMotion(
        states=np.column_stack([np.cos(200.0 * time), -np.sin(200.0 * time), np.zeros(n)]),
        covariance=np.zeros((n, 3, 3)),
        noise=1.0,
        force_sd=0.0,
        tau=1.0,
    )
    outliers = (time >= low) & (time < high) & (rng.random(n) < 0.05 / (high - low))
    everywhere = np.ones(n, dtype=bool)
    assert come_anywhere(outliers, everywhere, motion) == (high - low == 1.0)
    assert come_anywhere(np.zeros(n, dtype=bool), everywhere, motion)


def test_where_outliers_may_not_act_none_is_set_aside(rng: np.random.Generator) -> None:
    record, _, _ = decay(rng, force=0.2, hit=HIT)
    fit = fitted(record, ["random_force"])
    assert np.isfinite(fit.clock.variance).all()
    assert list(fit.sensor_noise.probabilities()) == [frozenset()]


@pytest.mark.parametrize("fault", ["outliers", "sensor_clipping"])
def test_without_a_force_both_give_a_law_the_same_evidence(fault: str, seed: int) -> None:
    """The regression without the samples set aside, and a fit of all of them, approximate one evidence."""
    values = {"outliers": {"outliers.fraction": 0.03, "outliers.scale": 2e-3}}
    clipped = {"sensor_clipping.level": 0.014}
    record = decays.short_decay(seed=seed, effects=values.get(fault, clipped))
    (segment,) = cut_records([record], decays.SYSTEM)
    fit = fit_random_force(segment, decays.SYSTEM, ("viscous_damping", fault, "random_force"))
    assert fit is not None
    assert np.isinf(fit.clock.variance).any()
    for names in (frozenset[str](), frozenset({"viscous_damping"})):
        simulated = simulated_fit(segment, decays.SYSTEM, (*names, fault), {})
        mine = log_evidence_without_force(fit, simulated, names)
        assert mine == pytest.approx(log_evidence(simulated), abs=1.5)


@pytest.mark.parametrize("fault", ["outliers", "sensor_clipping"])
def test_the_report_names_the_force_and_the_fault(fault: str, rng: np.random.Generator) -> None:
    ceiling = CEILING if fault == "sensor_clipping" else np.inf
    record, _, far = decay(rng, force=0.5, hit=HIT if fault == "outliers" else 0.0, ceiling=ceiling)
    rivals = ("viscous_damping", "cubic_stiffness", "sensor_nonlinearity", "timing_jitter", "random_force")
    report = fb.close_loop([record], SYSTEM, seed=1, effects=(*rivals, "outliers", "sensor_clipping"))
    # outliers are noise, and say nothing of the law
    assert report.verdict in ("explained", "ambiguous", *["adequate"] * (fault == "outliers"))
    named = {effect["name"]: effect for effect in report.effects}
    assert {"random_force", fault} <= set(named)
    assert named["random_force"]["probability"] > 0.95
    assert named[fault]["probability"] > 0.999
    parameters = named[fault]["parameters"]
    if fault == "outliers":
        assert parameters["fraction"]["mean"] == pytest.approx(far.mean(), rel=0.4)
        assert parameters["scale"]["mean"] == pytest.approx(FAR * NOISE, rel=0.4)
    else:
        assert parameters["level"]["mean"] == pytest.approx(CEILING)
    assert all(fault in c["effects"] or c["probability"] < 1e-3 for c in report.candidates)
    assert sum(c["probability"] for c in report.candidates) == pytest.approx(1.0)
    low, high = report.friction_after["interval90"]
    width = high - low
    assert low - 0.5 * width < 100.0 * FRICTION < high + 0.5 * width
    assert 0 < report.fitted["set_aside"] < 0.4 * report.fitted["samples"]
    assert report.noise["sd"] == pytest.approx(NOISE, rel=0.1)
    assert report.residual["after"]["channels"]["tails"]["p_value"] > 1e-3


def test_samples_at_a_ceiling_that_may_not_be_one_were_measured(rng: np.random.Generator) -> None:
    record, _, _ = decay(rng, force=0.5, ceiling=CEILING)
    rivals = ("viscous_damping", "cubic_stiffness", "sensor_nonlinearity", "outliers", "random_force")
    report = fb.close_loop([record], SYSTEM, seed=1, effects=rivals)
    assert not any("sensor_clipping" in c["effects"] for c in report.candidates)
    # a bent scale explains it, and is not the only effect that may
    assert report.verdict in ("ambiguous", "unexplained")


def test_a_law_that_cannot_matter_has_no_evidence(seed: int) -> None:
    """Its coefficients are not looked at next to those of a set that is hundreds of nats more probable."""
    effects = {"outliers.fraction": 0.03, "outliers.scale": 2e-3, "viscous_damping.damping_ratio": 0.03}
    (segment,) = cut_records([decays.short_decay(seed=seed, effects=effects)], decays.SYSTEM)
    both = ("viscous_damping", "outliers")
    fit = fit_random_force(segment, decays.SYSTEM, (*both, "random_force"))
    assert fit is not None
    best = simulated_fit(segment, decays.SYSTEM, both, effects)
    damped = log_evidence_without_force(fit, best, frozenset({"viscous_damping"}))
    assert np.isfinite(damped)
    assert log_evidence_without_force(fit, best, frozenset()) < damped - 100.0


def test_a_gap_is_part_of_the_time_that_is_fitted() -> None:
    """The last sample lies where it was read, not as many steps on as there are samples."""
    system = fb.Oscillator(mass=10.0, stiffness=1000.0)
    record = fb.simulate(
        system,
        friction=3.0,
        initial_displacement=0.05,
        duration=1.15,
        sampling_rate=100.0,
        noise_sd=1e-4,
        seed=1,
    )
    time = record["time"].values
    kept = record[(time < 0.2) | (time > 0.5)]
    found = fb.close_loop(kept, system, seed=1, effects=()).fitted
    assert found["to_s"] == pytest.approx(time[-1], abs=0.02)
    assert found["half_cycles"] == 3
    assert found["samples"] == pytest.approx(kept.size, abs=2)


def test_a_clipped_record_that_lost_rows_is_clipped(rng: np.random.Generator) -> None:
    """What is put in their place may lie beyond the range, and is none of its ends."""
    record, _, _ = decay(rng, force=0.0, ceiling=CEILING)
    kept = rng.random(record.size) > 0.1
    whole, lost = (cut_records([each], SYSTEM)[0] for each in (record, record[kept]))
    assert whole.clipped
    assert lost.clipped
    share = np.count_nonzero(lost.sides) / np.count_nonzero(whole.sides)
    assert share == pytest.approx(0.9, abs=0.05)
