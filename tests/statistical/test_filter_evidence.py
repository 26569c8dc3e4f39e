"""Filters are compared by the noise behind them without favour: the right one is as probable as it says.

Noise of each kind of filter goes with a motion that is known but for its coefficients. What is judged is the
rank of the right corner in the posterior of the corners of its own kind, which is uniform where the evidence
is right: of 40 records each, Kolmogorov's test at 1e-3 a kind.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal, stats

from friction_bayes.core.arrays import Array
from friction_bayes.estimators.noise import filter_evidence
from friction_bayes.estimators.noise.filter_evidence import likely_filters
from friction_bayes.estimators.noise.recording_filters import kinds_for

PER_PERIOD = 150
ANGLE = 2.0 * math.pi / PER_PERIOD
SAMPLES = 2500
RECORDS = 40


def _through(sos: Array, values: Array, *, both: bool) -> Array:
    return np.asarray((signal.sosfiltfilt if both else signal.sosfilt)(sos, values))


def _low_pass(name: str, corner: float) -> Array:
    if "Bessel" in name:
        return np.asarray(signal.bessel(4, corner / math.pi, norm="mag", output="sos"))
    return np.asarray(signal.butter(int(name.split()[1].rstrip(",")), corner / math.pi, output="sos"))


@pytest.mark.parametrize(
    ("name", "lowest"),
    [
        ("order 2, corner", 4.5),
        ("order 1, forward", 4.5),
        ("order 2, forward", 4.5),
        ("order 4, corner", 4.5),
        # forgets what was before the record so fast that little but rounding is left of it
        ("Bessel filter of order 4, corner", 2.0),
    ],
)
def test_the_corner_is_as_uncertain_as_it_says(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch, name: str, lowest: float
) -> None:
    kind = next(each for each in kinds_for(ANGLE, 0) if name in each.of(float(each.sizes[0])).name)
    # corners that neither end of the range is near
    places, low = kind.sizes / ANGLE, lowest
    corners = kind.sizes[(places > low) & (places < 1.33 * low)]
    only = replace(kind, sizes=kind.sizes[(places > 0.78 * low) & (places < 1.78 * low)])
    monkeypatch.setattr(filter_evidence, "kinds_for", lambda angle, order: [only])
    monkeypatch.setattr(filter_evidence, "_MOST", only.sizes.size)
    monkeypatch.setattr(filter_evidence, "_MUCH_LESS", 1e-9)
    both = "forward" in name
    phase = ANGLE * np.arange(-200, SAMPLES + 200)
    columns = np.column_stack([np.cos(phase), np.sin(phase), np.ones(phase.size)])
    ranks = []
    for _ in range(RECORDS):
        corner = float(rng.choice(corners))
        motion = columns @ [1.0, 0.3, 0.0] + 1e-3 * rng.standard_normal(phase.size)
        recorded = _through(_low_pass(name, corner), motion, both=both)[200:-200]
        seen = columns[200:-200]
        found = likely_filters(recorded, np.zeros(SAMPLES), seen, seen, ANGLE, 0)
        assert found.probability > 0.5
        # a larger corner has a larger gain
        gain = kind.of(corner).gain
        below = sum(share for share, each in found.likely if each.gain < gain - 1e-12)
        level = sum(share for share, each in found.likely if abs(each.gain - gain) < 1e-12)
        ranks.append(below + float(rng.random()) * level)
    assert stats.kstest(ranks, "uniform").pvalue > 1e-3
