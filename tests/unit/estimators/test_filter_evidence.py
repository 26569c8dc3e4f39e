"""What the evidence for filters leaves of a signal."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from friction_bayes.estimators.noise import filter_evidence
from friction_bayes.estimators.noise.filter_evidence import _of_kind, least_squares_residual, likely_filters
from friction_bayes.estimators.noise.recording_filters import FilterKind, RecordingFilter, kinds_for

SAMPLES = 400


def test_a_column_of_rounding_explains_nothing(rng: np.random.Generator) -> None:
    """Whitening leaves no more of some columns; free coefficients would fit the noise with them."""
    noise = 1e-3 * rng.standard_normal(SAMPLES)
    swing = np.cos(0.3 * np.arange(SAMPLES))
    rounding = 1e-17 * rng.standard_normal((20, SAMPLES))
    signal = 2.0 * swing + noise
    alone, _ = least_squares_residual(signal, swing[None], 1e-3)
    left, _ = least_squares_residual(signal, np.vstack([swing, rounding]), 1e-3)
    np.testing.assert_allclose(left, alone, atol=1e-12)
    np.testing.assert_allclose(alone, least_squares_residual(signal, swing[None])[0], atol=1e-8)


def test_a_second_fit_takes_what_rounding_left_of_the_first(rng: np.random.Generator) -> None:
    """Columns that nearly agree have large coefficients that nearly cancel."""
    swing, other = np.cos(0.3 * np.arange(SAMPLES)), rng.standard_normal(SAMPLES)
    rows = np.vstack([swing, swing + 1e-4 * other])
    left, _ = least_squares_residual(3.0 * swing + other, rows)
    assert np.max(np.abs(left)) < 2e-3


@pytest.mark.parametrize(("samples", "angle"), [(10, 1.6), (16, 1.0), (36, 1.6), (45, 0.5)])
def test_too_few_samples_decide_on_no_filter(rng: np.random.Generator, samples: int, angle: float) -> None:
    phase = angle * np.arange(samples)
    swing = np.column_stack([np.cos(phase), np.sin(phase)])
    signal = swing[:, 0] + 1e-3 * rng.standard_normal(samples)
    found = likely_filters(signal, np.zeros(samples), swing, swing, angle, 0)
    assert not found.kinds
    assert found.likely == []
    assert found.probability == 0.0


def test_filters_of_one_name_have_their_own_evidence(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of Gaussian weights neighbours may have one name in words."""
    phase = 0.3 * np.arange(SAMPLES)
    swing = np.column_stack([np.cos(phase), np.sin(phase)])
    signal = swing[:, 0] + np.cumsum(1e-3 * rng.standard_normal(SAMPLES))

    def evidence(name_of: Callable[[float], str]) -> list[float]:
        def named(angle: float, order: int) -> list[FilterKind]:
            (weights,) = (kind for kind in kinds_for(angle, order) if kind.name == "Gaussian weights")
            return [replace(weights, of=lambda size: replace(weights.of(size), name=name_of(size)))]

        monkeypatch.setattr(filter_evidence, "kinds_for", named)
        (found,) = likely_filters(signal, np.zeros(SAMPLES), swing, swing, 0.3, 0).kinds
        return [value for value, _ in found.filters]

    assert evidence(lambda size: "alike") == evidence(repr)


def test_the_higher_of_two_humps_is_found_where_both_are_tried_first() -> None:
    """As of a Bessel filter of an accelerometer, whose corners resemble those at half its corner."""
    kind = next(kind for kind in kinds_for(10.0 / 240.0, 0) if kind.name.startswith("Bessel"))

    def log_evidence(filter_: RecordingFilter) -> float:
        corner = float(filter_.name.split("corner at ")[1].split()[0])
        wide, narrow = (math.log(corner / place) for place in (2.7, 4.89))
        return max(100.0 - 1500.0 * wide**2, 700.0 - 34000.0 * narrow**2, 35.0 - 200.0 * abs(narrow))

    found = _of_kind(kind, 0.0, lambda filter_: 0.0, log_evidence, 0.0)
    assert found.filters[0][0] == pytest.approx(700.0, abs=1.0)


def test_sizes_are_tried_as_finely_as_they_may_be_probable() -> None:
    """Next to a filter that is certain others of its kind are tried a twentieth apart, else every fourth."""
    kind = next(kind for kind in kinds_for(10.0 / 240.0, 0) if kind.name.startswith("Bessel"))

    def tried(log_other: float) -> int:
        return len(_of_kind(kind, 0.0, lambda _: 0.0, lambda each: -abs(each.gain - 0.99), log_other).filters)

    few, some, many = (tried(log_other) for log_other in (1e3, 100.0, 0.0))
    assert few < some < many
    # with as even a log evidence nothing between them is as probable as that
    assert tried(20.0) == some
    assert few == 1 + math.ceil(math.log(kind.sizes[-1] / kind.sizes[0]) / math.log(1.12) / 4)
