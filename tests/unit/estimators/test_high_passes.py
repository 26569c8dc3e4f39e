"""High passes are found by what they make of the motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

from friction_bayes.estimators.noise.high_passes import (
    MotionBehind,
    filters_of,
    likely_high_passes,
)
from friction_bayes.estimators.noise.recording_filters import Through, kinds_for

ANGLE, SAMPLES, NOISE = 2.0 * math.pi / 80.0, 1200, 2e-3
PHASE = ANGLE * np.arange(SAMPLES)
SWING = np.column_stack([(1.0 - PHASE / 200.0) * np.cos(PHASE), np.sin(PHASE)])
KNOWN = np.zeros(SAMPLES)


def behind(corner: float, order: int, rng: np.random.Generator) -> np.ndarray:
    """A swing behind an AC coupling that has not settled, and white noise."""
    (kind,) = (each for each in kinds_for(ANGLE, order) if each.name == "AC coupling")
    filter_ = kind.of(corner * ANGLE)
    shown = Through(SWING)(filter_) @ [1.0, 0.2] + 0.5 * filter_.memory(SAMPLES)[:, 0]
    return shown + NOISE * rng.standard_normal(SAMPLES)


@pytest.mark.parametrize("corner", [0.02, 0.1, 0.3])
def test_the_corner_is_found(corner: float, rng: np.random.Generator) -> None:
    (kind,) = (each for each in kinds_for(ANGLE, 0) if each.name == "AC coupling")
    log_likelihood = MotionBehind(behind(corner, 0, rng), KNOWN, SWING, ANGLE)
    found = filters_of(kind, log_likelihood)
    values = np.array([log_likelihood(each) for each in found])
    assert values.argmax() == 0
    # several stand for all, each with the prior of its share of the range
    assert 3 <= len(found) <= 7
    assert all(each.log_prior < math.log(kind.prior / len(found)) for each in found)
    log_corners = np.log([-each.settling[0].real / ANGLE for each in found])
    share = np.exp(values - values.max())
    mean = share @ log_corners / share.sum()
    sd = math.sqrt(share @ (log_corners - mean) ** 2 / share.sum())
    # false alarm 1e-4
    assert abs(mean - math.log(corner)) < 4.0 * sd


def test_a_corner_that_a_record_does_not_show_may_be_any() -> None:
    (kind,) = (each for each in kinds_for(ANGLE, 0) if each.name == "AC coupling")
    found = filters_of(kind, lambda _: 0.0)
    assert len(found) == 16
    assert sum(math.exp(each.log_prior) for each in found) == pytest.approx(kind.prior, rel=0.1)
    assert filters_of(kind, lambda _: 0.0, least=1.0) == []


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_record_that_has_gone_through_none_has_none(order: int, rng: np.random.Generator) -> None:
    signal = SWING @ [1.0, 0.2] + NOISE * rng.standard_normal(SAMPLES)
    assert likely_high_passes(MotionBehind(signal, KNOWN, SWING, ANGLE), order) == []
    found = likely_high_passes(MotionBehind(behind(0.1, order, rng), KNOWN, SWING, ANGLE), order)
    assert sum(share for share, _ in found) == pytest.approx(1.0)
    assert found[0][0] == max(share for share, _ in found)
    assert found[0][1].name.startswith("an AC coupling")


def test_a_short_record_has_none(rng: np.random.Generator) -> None:
    signal = behind(0.1, 0, rng)
    assert likely_high_passes(MotionBehind(signal[:70], KNOWN[:70], SWING[:70], ANGLE), 0) == []


def test_a_motion_may_be_in_its_own_time_or_in_that_of_the_recording(rng: np.random.Generator) -> None:
    """What jumps lies elsewhere behind a filter in the one and in the other."""
    (kind,) = (each for each in kinds_for(ANGLE, 2) if each.name == "AC coupling")
    filter_, columns = kind.of(0.2 * ANGLE), np.column_stack([SWING, np.sign(np.sin(PHASE))])
    signal = Through(columns)(filter_) @ [1.0, 0.2, 0.3] + NOISE * rng.standard_normal(SAMPLES)
    own, recorded = (MotionBehind(signal, KNOWN, columns, ANGLE, in_time=each) for each in (True, False))
    assert np.std(own.left(filter_)) < 1.1 * NOISE
    assert np.std(recorded.left(filter_)) > 3.0 * NOISE
