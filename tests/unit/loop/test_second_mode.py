"""A second mode that dies out, in addition to the motion, with a force that fluctuates and without."""

from __future__ import annotations

import math

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.decay.spectral_lines import decaying_lines, steady_lines
from friction_bayes.loop.data.prepared_record import Segment, cut_records
from friction_bayes.loop.infer.finer_columns import line_search, lines_in_residual
from friction_bayes.loop.infer.law_fit import fit_law
from loop_options import loop_options
from unsteady_decays import FINE, FRICTION, RELEASE, RINGING, SYSTEM, fitted, probability_of, ringing_record

OFFERED = ("viscous_damping", "sensor_offset", "periodic_interference", "second_mode")
LINES = {"periodic_interference", "second_mode"}


@pytest.fixture
def segment(rng: np.random.Generator) -> Segment:
    return cut_records([ringing_record(rng, 0.0, 1.0)], SYSTEM)[0]


@pytest.mark.parametrize("order", [0, 1, 2])
def test_it_is_found_beside_a_force_and_friction_with_it(rng: np.random.Generator, order: int) -> None:
    fit = fitted(ringing_record(rng, 0.01, 1.5, order), OFFERED)
    assert probability_of(fit, "second_mode") > 0.99
    assert probability_of(fit, "periodic_interference") < 0.1
    (line,) = (line for line in fit.lines if not line.steady)
    assert line.frequency == pytest.approx(RINGING, abs=3.0 * line.scatter / (2.0 * math.pi * 1.5))
    assert abs(math.log(line.decay_time / 1.5)) < 3.0 * line.scatter < 0.5
    found = {c.parameter: x for c, x in zip(fit.law.columns, fit.coefficients, strict=True) if c.line == line}
    size = RELEASE * 10.0**order
    assert math.hypot(found["sine"], found["cosine"]) == pytest.approx(0.01 * size, rel=0.1)
    assert fit.coefficients[fit.law.dry_friction] == pytest.approx(FRICTION, rel=0.08)


@pytest.mark.parametrize("missing", [0.0, 0.1])
def test_lines_are_found_whether_the_clock_is_even_or_not(rng: np.random.Generator, missing: float) -> None:
    """By their times: by the number of the sample, one in ten missing, a line would be spread too thin."""
    record = ringing_record(rng, 0.0, 1.0)
    segment = cut_records([record[rng.random(record.size) >= missing]], SYSTEM)[0]
    noise, angle = rng.standard_normal((2, segment.time.size)), 2.0 * math.pi * RINGING * segment.time
    left = noise[0] + 0.7 * np.sin(angle)
    (line,) = lines_in_residual(left, noise[1], segment, (), {"periodic_interference"})
    assert line.frequency == pytest.approx(RINGING, abs=0.1 / segment.time[-1])


def test_a_line_that_lasts_is_interference(rng: np.random.Generator) -> None:
    fit = fitted(ringing_record(rng, 0.01, math.inf), OFFERED)
    assert probability_of(fit, "periodic_interference") > 0.99
    assert probability_of(fit, "second_mode") < 0.1


def test_it_is_found_where_no_force_fluctuates() -> None:
    """A law along the measured motion has it, and forecasts with it."""
    record = fb.simulate(
        SYSTEM,
        friction=0.02,
        initial_displacement=0.02,
        duration=12.0,
        sampling_rate=100.0,
        noise_sd=1e-4,
        seed=5,
        effects={
            "second_mode.sine": 4e-4,
            "second_mode.cosine": -3e-4,
            "second_mode.frequency": RINGING,
            "second_mode.decay_time": 2.0,
        },
    )
    report = fb.close_loop([record], SYSTEM, seed=1, check=False)
    assert report.candidates[0]["effects"] == ["second_mode"]
    assert report.residual["after"]["failed"] == []
    (effect,) = [e for e in report.effects if e["name"] == "second_mode"]
    found = effect["parameters"]
    for name, true in {"frequency": RINGING, "decay_time": 2.0, "sine": 4e-4, "cosine": -3e-4}.items():
        assert abs(found[name]["mean"] - true) < 4.0 * found[name]["sd"] < 0.6 * abs(true)
    assert any("4.30" in line and "dies out" in line for line in report.trail)
    low, high = report.friction_after["interval90"]
    assert low < 0.02 < high
    assert report.held_out_error["after"] < 1.2e-4


def test_a_steady_line_that_imitated_one_that_dies_out_goes(rng: np.random.Generator) -> None:
    """Of the whole record's spectrum it is the first to be found, and there is interference too."""
    record = ringing_record(rng, 0.02, 1.5)
    steady = 0.01 * RELEASE * np.sin(2.0 * np.pi * 7.0 * record["time"].values)
    fit = fitted(record + steady, OFFERED)
    assert [line.frequency for line in fit.lines if line.steady] == pytest.approx([7.0], abs=0.01)
    assert [line.frequency for line in fit.lines if not line.steady] == pytest.approx([RINGING], abs=0.05)


def test_every_line_of_an_effect_is_reported(rng: np.random.Generator) -> None:
    """All of them are one effect, whose parameters are those of the strongest."""
    record = ringing_record(rng, 0.02, 1.5)
    time = record["time"].values
    size, modes, mains = 0.01 * RELEASE, {RINGING: (2.0, 1.5), 9.7: (1.5, 2.5)}, {13.0: 0.3, 21.0: 0.6}
    amplitude, decay_time = modes[9.7]
    more = amplitude * np.exp(-time / decay_time) * np.sin(2.0 * np.pi * 9.7 * time)
    for frequency, steady in mains.items():
        more += steady * np.sin(2.0 * np.pi * frequency * time + 1.0)
    report = fb.close_loop([record + size * more], SYSTEM, seed=1, effects=[*OFFERED, "random_force"])
    lines = {effect["name"]: effect["lines"] for effect in report.to_dict()["effects"]}
    assert lines.pop("random_force") == []
    assert lines.keys() == LINES
    dying, lasting = (
        sorted(lines[name], key=lambda line: line["frequency"]["mean"])
        for name in ("second_mode", "periodic_interference")
    )
    for line, (frequency, (amplitude, decay_time)) in zip(dying, modes.items(), strict=True):
        for name, true in {"frequency": frequency, "decay_time": decay_time}.items():
            assert abs(line[name]["mean"] - true) < 4.0 * line[name]["sd"] < 0.5 * true
        assert abs(line["amplitude"]["mean"] - amplitude * size) < 4.0 * line["amplitude"]["sd"]
        assert line["amplitude"]["sd"] < 0.15 * amplitude * size
    for line, (frequency, amplitude) in zip(lasting, mains.items(), strict=True):
        assert abs(line["frequency"]["mean"] - frequency) < 4.0 * line["frequency"]["sd"] < 0.1
        assert abs(line["amplitude"]["mean"] - amplitude * size) < 4.0 * line["amplitude"]["sd"]
        assert line["decay_time"] is None
    reported = next(effect["parameters"] for effect in report.effects if effect["name"] == "second_mode")
    assert reported["decay_time"] in [line["decay_time"] for line in dying]


@pytest.mark.parametrize("random_force", ["none", "auto"])
def test_each_record_has_its_own_line_of_interference(random_force: str) -> None:
    sizes = (3e-4, 6e-4)
    records = [
        fb.simulate(
            SYSTEM,
            friction=0.02,
            initial_displacement=0.02,
            duration=10.0,
            sampling_rate=100.0,
            noise_sd=1e-4,
            seed=seed,
            effects={"periodic_interference.amplitude": size, "periodic_interference.frequency": 7.3},
        )
        for seed, size in enumerate(sizes)
    ]
    offered = ["periodic_interference", "random_force"]
    report = fb.close_loop(records, SYSTEM, seed=1, random_force=random_force, effects=offered)
    (effect,) = report.effects
    assert [line["record"] for line in effect["lines"]] == [0, 1]
    for r, (line, size) in enumerate(zip(effect["lines"], sizes, strict=True)):
        assert line["frequency"]["mean"] == pytest.approx(7.3, abs=0.01)
        assert line["amplitude"]["mean"] == pytest.approx(size, rel=0.1)
        assert line["amplitude"] == pytest.approx(effect["parameters"][f"amplitude[{r}]"])
        assert line["decay_time"] is None


def test_records_may_ring_each_in_its_own_way(rng: np.random.Generator) -> None:
    segments = cut_records([ringing_record(rng, size, 1.5) for size in (0.01, 0.02)], SYSTEM)
    joint = fit_law(segments, SYSTEM, loop_options(OFFERED))
    rings = ["second_mode" in names for names in joint.sets]
    assert joint.weight[:, rings].sum() > 0.99


def test_lines_that_die_out_are_found_under_their_envelopes(
    rng: np.random.Generator, segment: Segment
) -> None:
    time = FINE * np.arange(segment.moving)
    noise = rng.standard_normal(time.size)
    modes = {4.0: 0.8, 11.9: 2.0, 23.0: 5.0}
    ringing = sum(3.0 * np.exp(-time / t) * np.sin(2.0 * np.pi * f * time + f) for f, t in modes.items())
    found = sorted(decaying_lines(noise + ringing, line_search(segment)))
    assert [line.frequency for line in found] == pytest.approx(sorted(modes), abs=0.1)
    for line, true in zip(found, modes.values(), strict=True):
        assert abs(math.log(line.decay_time / true)) < 3.5 * line.scatter
    assert decaying_lines(noise + ringing, line_search(segment), known=found) == ()
    assert decaying_lines(noise, line_search(segment)) == ()


def test_neither_a_line_that_lasts_nor_a_harmonic_is_a_mode(
    rng: np.random.Generator, segment: Segment
) -> None:
    time = FINE * np.arange(segment.moving)
    noise = rng.standard_normal(time.size)
    lasting = noise + np.sin(2.0 * np.pi * RINGING * time)
    assert decaying_lines(lasting, line_search(segment)) == ()
    assert len(steady_lines([lasting], line_search(segment))) == 1
    for harmonic in (1.0, 2.0, 3.0):
        decaying = 5.0 * np.exp(-time / 3.0) * np.sin(harmonic * segment.decay.frequency * time)
        assert decaying_lines(noise + decaying, line_search(segment)) == ()


def test_lines_come_beside_three_effects(rng: np.random.Generator) -> None:
    record = ringing_record(rng, 0.01, 1.5)
    steady = 0.01 * RELEASE * np.sin(2.0 * np.pi * 7.0 * record["time"].values)
    fit = fitted(record + steady, (*OFFERED, "quadratic_drag", "cubic_stiffness"))
    assert {line.effect for line in fit.lines} == LINES
    assert any(len(names - LINES - {"sensor_offset"}) == 3 and names >= LINES for names in fit.sets)
    assert probability_of(fit, "second_mode") > 0.99
    assert probability_of(fit, "periodic_interference") > 0.99
