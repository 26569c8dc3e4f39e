"""What an ordinary laboratory records: the default estimates right, or refuses.

The recipes are those of the experiment of this name, which share no code with the package; their seeds here
are the suite's own. Groups of records are judged together: where 85 % of intervals cover the friction that
acted and 3 % are a whole interval off, a limit is passed once in 170 runs at most. A group of five, six or
seven that covers in 20 % is seen in 74, 90 or 85 % of runs, one that is off in half in 50, 66 or 77 %.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest
from scipy import stats

import friction_bayes as fb
from curtailed import at_least
from experiments.ordinary.recipes import RECIPES

GROUPS = {
    "clean": ("short, one accelerometer", "short and clean", "few samples"),
    "low pass": (
        "low pass: causal",
        "low pass: zero phase",
        "low pass: Savitzky-Golay",
        "low pass: moving mean",
        "10 kg: acceleration, causal at 16 Hz",
        "10 kg: displacement, zero phase at 8 Hz",
        "10 kg: displacement, zero phase at 16 Hz",
    ),
    "converted": (
        "straight lines between every tenth sample",
        "displacement differentiated once",
        "displacement differentiated twice",
        "acceleration integrated twice",
        "AC coupled",
        "saturated",
    ),
    "fluctuating": (
        "friction: each half cycle anew",
        "friction: telegraph",
        "friction: 1/f",
        "friction: locked to the place",
        "random force",
    ),
    "resisted": (
        "resisted: viscous damping",
        "resisted: quadratic drag",
        "resisted: friction that changes",
        "resisted: Stribeck friction",
        "resisted: pre-sliding",
    ),
    "disturbed": ("hand at the start", "hand at the start, 200 half cycles", "driven, then free"),
}
FEWEST = 5
"""Records of a group, or of a kind that is judged alone."""
MISSED, OFF = 0.15, 0.03
ONCE = 6e-3


class Verdict(NamedTuple):
    """Whether a record was refused; else whether the interval covers, or the mean is a whole interval off."""

    refused: bool
    covers: bool
    off: bool


def verdict(row: str, number: int, sequence: np.random.SeedSequence) -> Verdict:
    ordinary = RECIPES[row](np.random.default_rng(sequence), number)
    record = fb.make_record(ordinary.times, ordinary.values, ordinary.quantity)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.RecordWarning)
        try:
            found = fb.estimate(record, fb.Oscillator(mass=ordinary.mass, stiffness=ordinary.stiffness))
        except fb.InputError:
            return Verdict(True, False, False)
    if ordinary.truth is None:
        return Verdict(False, False, True)
    begins = found.decay.start_time
    truth = ordinary.truth(begins, begins + found.decay.duration)
    low, high = found.friction.interval(0.9)
    assert low >= 0.0
    return Verdict(False, low <= truth <= high, abs(found.friction.mean() - truth) > high - low)


def verdicts(rows: tuple[str, ...], seed: int) -> Iterator[Verdict]:
    replicates = -(-FEWEST // len(rows))
    sequences = np.random.SeedSequence(seed).spawn(len(rows) * replicates)
    named = [(row, number) for row in rows for number in range(replicates)]
    return (verdict(row, number, each) for (row, number), each in zip(named, sequences, strict=True))


@pytest.mark.parametrize("group", GROUPS)
def test_the_default_answers_right_or_refuses(group: str, seed: int) -> None:
    reported = list(verdicts(GROUPS[group], seed))
    found = [each for each in reported if not each.refused]
    if group in ("clean", "low pass", "fluctuating"):
        assert len(reported) - len(found) <= 1
    missed, off = sum(not each.covers for each in found), sum(each.off for each in found)
    assert missed <= stats.binom.isf(ONCE, len(found), MISSED)
    assert off <= stats.binom.isf(ONCE, len(found), OFF)


def test_a_drive_alone_and_saturated_records_are_refused(seed: int) -> None:
    # one in forty seems to fall, and the mildest saturation hides in the noise
    for row in ("steady drive alone", "saturated"):
        assert at_least(FEWEST - 1, (each.refused for each in verdicts((row,), seed)))


def test_a_clean_accelerometer_of_four_half_cycles_keeps_its_interval() -> None:
    """But where other forces are not improbable: one record of five gives them a probability of .2."""
    system = fb.Oscillator(mass=1.0, stiffness=400.0)
    wider = []
    for seed in range(1, 6):
        record = fb.simulate(
            system,
            friction=0.31111,
            initial_displacement=0.01,
            duration=0.70686,
            sampling_rate=477.465,
            noise_sd=0.012,
            quantity="acceleration",
            seed=seed,
        )
        found, plain = fb.estimate(record, system), fb.estimate(record, system, random_force="none")
        low, high = found.friction.interval(0.9)
        wider.append((high - low) / float(np.subtract(*plain.friction.interval(0.9)[::-1])))
        assert abs(found.friction.mean() - 0.31111) < high - low
        assert found.random_force is not None
        assert found.random_force.probability < 0.1
        assert found.noise_sd == pytest.approx(0.012, rel=0.15)
    assert np.median(wider) < 1.05
    assert max(wider) < 1.5
