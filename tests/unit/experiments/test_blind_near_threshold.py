from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from experiments.blind.laws import Law, integrate
from experiments.blind.misleading_records import MISLEADING, draw_misleading
from experiments.blind.near_threshold import (
    AMPLITUDE,
    FRICTION,
    KINDS,
    NOISE,
    PLAIN,
    SIZES,
    SYSTEM,
    ImitatingEffect,
    ThresholdRecord,
    draw_effect_of_size,
    draw_near_threshold,
    sampled,
)

DISSIPATION = FRICTION / (SYSTEM["stiffness"] * AMPLITUDE)
TIMES = 0.05 * np.arange(2800)
PLAIN_SIGNAL = sampled(ImitatingEffect())


@cache
def _coulomb_changes() -> np.ndarray:
    """Orthonormal changes of the signal by a Coulomb decay's own parameters and by the sensor's zero."""
    step = 1e-5

    def coulomb(friction: float = DISSIPATION, speed: float = 1.0, late: float = 0.0, start: float = 1.0):  # type: ignore[no-untyped-def]
        motion = integrate(Law(friction=friction), start, 0.0, 145.0)
        return motion.sample(np.maximum(speed * TIMES + late, 0.0))[0]

    changed = [
        coulomb(friction=(1.0 + step) * DISSIPATION),
        coulomb(speed=1.0 + step),
        coulomb(late=step),
        coulomb(start=1.0 + step),
    ]
    own = np.column_stack([(x - PLAIN_SIGNAL) / step for x in changed] + [np.ones(TIMES.size)])
    return np.linalg.qr(own)[0]


def _what_coulomb_leaves(signal: np.ndarray) -> float:
    """Euclidean length of a change of the signal next to those of a Coulomb decay's own parameters."""
    basis, change = _coulomb_changes(), signal - PLAIN_SIGNAL
    return float(np.linalg.norm(change - basis @ (basis.T @ change)))


@pytest.mark.parametrize("kind", SIZES)
def test_what_is_called_seen_is_seen_and_a_hundredth_of_it_is_not(kind: str, seed: int) -> None:
    seen, largest = SIZES[kind]
    assert seen < largest

    def length(size: float, number: int) -> float:
        """Of what is left of a draw, in standard deviations of the noise."""
        signal = sampled(draw_effect_of_size(kind, size, np.random.default_rng(seed + number)))
        return _what_coulomb_leaves(signal) / (NOISE / AMPLITUDE)

    assert 1.2 < np.median([length(seen, number) for number in range(3)]) < 6.0
    # ten times what is expected, so that one draw shows it
    assert length(0.01 * seen, 0) < 0.5


@pytest.mark.parametrize(
    ("law", "force"),
    [
        ({"stiffness_change": 0.3}, lambda t, x, s: x * (1.0 + 0.3 * (t / 140.0 - 0.5)) + DISSIPATION * s),
        ({"quadratic_stiffness": 0.1}, lambda t, x, s: x + 0.1 * x * abs(x) + DISSIPATION * s),
        ({"friction_bend": 0.5}, lambda t, x, s: x + DISSIPATION * s * (1.0 + 0.5 * x * x)),
        ({"friction_tilt": 0.5}, lambda t, x, s: x + DISSIPATION * s * (1.0 + 0.5 * x)),
        ({"friction_rise": -0.5}, lambda t, x, s: x + DISSIPATION * s * (1.0 - 0.5 * abs(x))),
    ],
)
def test_laws_agree_with_a_dense_solution(law: dict[str, float], force) -> None:  # type: ignore[no-untyped-def]
    ours = sampled(ImitatingEffect(law=law))
    turns = integrate(Law(friction=DISSIPATION, duration=140.0, **law), 1.0, 0.0, 20.0).turning_times

    def slope(t: float, y: np.ndarray) -> tuple[float, float]:
        # direction of the motion is taken from ours; between turning points it does not change
        sign = -1.0 if np.searchsorted(turns, t, side="right") % 2 == 0 else 1.0
        return y[1], -force(t, y[0], sign)

    within = TIMES < 19.0
    dense = solve_ivp(slope, (0.0, 20.0), (1.0, 0.0), max_step=0.01, rtol=1e-9, atol=1e-11, dense_output=True)
    np.testing.assert_allclose(ours[within], dense.sol(TIMES[within])[0], rtol=0, atol=1e-6)


def test_a_mass_that_sticks_at_the_turns_comes_later_by_its_pauses() -> None:
    pause, shift = 0.3, DISSIPATION
    signal = sampled(ImitatingEffect(pause=pause))
    # the second turning point is reached after two half cycles and one pause, and kept for another
    kept = (2.0 * math.pi + pause <= TIMES) & (2.0 * math.pi + 2.0 * pause >= TIMES)
    assert kept.sum() > 3
    np.testing.assert_allclose(signal[kept], 1.0 - 4.0 * shift, rtol=0, atol=1e-9)


def test_a_touch_acts_while_it_lasts() -> None:
    middle, length = 60.0, 6.0
    change = sampled(ImitatingEffect(touch=(0.05, middle, length))) - PLAIN_SIGNAL
    before, after = middle - 0.5 * length > TIMES, middle + 0.5 * length < TIMES
    assert np.max(np.abs(change[before])) < 1e-6
    assert np.max(np.abs(change[after])) > 0.01


def test_the_gain_is_right_in_the_middle() -> None:
    shown = sampled(ImitatingEffect(sensor={"gain_change": 0.2}))
    np.testing.assert_allclose(shown, PLAIN_SIGNAL * (1.0 + 0.2 * (TIMES / TIMES[-1] - 0.5)), atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_a_seed_decides_the_record(kind: str, seed: int) -> None:
    first, again = (draw_near_threshold(kind, seed) for _ in range(2))
    np.testing.assert_array_equal(first.records[0].values, again.records[0].values)
    assert first.records[0].size == 2800
    if kind == PLAIN:
        assert first.size == 0.0
    else:
        seen, largest = SIZES[kind]
        assert 0.01 * seen <= first.size <= largest


@pytest.mark.parametrize(("draw", "kind"), [(draw_near_threshold, PLAIN), (draw_misleading, "accelerometer")])
def test_another_seed_draws_another_record(
    draw: Callable[[str, int], ThresholdRecord], kind: str, seed: int
) -> None:
    first, other = (draw(kind, each).records[0].values for each in (seed, seed + 1))
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("kind", MISLEADING)
def test_a_seed_decides_records_that_mislead(kind: str, seed: int) -> None:
    first, again = (draw_misleading(kind, seed) for _ in range(2))
    low, high = MISLEADING[kind]
    assert low <= first.size <= high
    assert len(first.records) == (2 if kind == "differing_releases" else 1)
    for record, same in zip(first.records, again.records, strict=True):
        np.testing.assert_array_equal(record.values, same.values)
    off = abs(first.declared["stiffness"] / SYSTEM["stiffness"] - 1.0)
    assert off == pytest.approx(first.size if kind == "declared_off" else 0.0)


def test_an_accelerometer_shows_the_force_over_the_mass() -> None:
    record = draw_misleading("accelerometer", 3).records[0]
    amplitude = SYSTEM["stiffness"] / SYSTEM["mass"] * AMPLITUDE
    assert record.attrs["quantity"] == "acceleration"
    assert record.values[:5].mean() == pytest.approx(-amplitude + FRICTION / SYSTEM["mass"], rel=0.05)


def test_an_unknown_kind_is_refused(rng: np.random.Generator) -> None:
    with pytest.raises(ValueError, match="unknown kind 'warp'"):
        draw_effect_of_size("warp", 1.0, rng)
    with pytest.raises(ValueError, match="unknown kind 'warp'"):
        draw_misleading("warp", 1)
