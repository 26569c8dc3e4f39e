"""Laws of wear: clocks and their inverses, evidence that names the law, and lives that hold."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from friction_bayes.core.arrays import Array
from friction_bayes.monitor.clocks import ExponentialClock, JumpClock, KinkClock, PowerClock, WearClock
from friction_bayes.monitor.laws import fit_laws
from friction_bayes.monitor.points import DetectionPoints
from friction_bayes.monitor.remaining_life import remaining_life
from friction_bayes.monitor.report import follow
from friction_bayes.monitor.wear import default_wear_prior, fit_wear

TIME = np.linspace(0.0, 1.0, 40)
CLOCKS = [
    *(PowerClock(), PowerClock(2.0), PowerClock(0.3, 0.5)),
    *(ExponentialClock(3.0), ExponentialClock(-2.0)),
    *(KinkClock(0.6, 4.5), KinkClock(0.0, 3.0)),
]


@pytest.mark.parametrize("clock", CLOCKS, ids=repr)
def test_a_clock_shows_nought_at_the_first_point_and_one_at_the_last(clock: WearClock) -> None:
    np.testing.assert_allclose(clock.reading(np.array([0.0, 1.0])), [0.0, 1.0], atol=1e-12)
    reading = clock.reading(np.array([1.1, 1.7]))
    np.testing.assert_allclose(clock.when(reading), [1.1, 1.7], rtol=1e-9)
    step = 1e-6
    pace = float(np.diff(clock.reading(1.0 + step * np.array([-1.0, 1.0])))[0]) / (2.0 * step)
    assert clock.pace == pytest.approx(pace, rel=1e-6)


def test_a_clock_that_stops_never_shows_more() -> None:
    clock = ExponentialClock(-2.0)
    limit = 1.0 / -math.expm1(-2.0)
    assert clock.when(np.array([limit + 1e-3])).size == 0
    assert float(clock.reading(np.array([1e6]))[0]) == pytest.approx(limit)


SHAPES: dict[str, tuple[Callable[[Array], Array], str, float]] = {
    "line": (lambda t: t, "linear", 1.0),
    "square": (lambda t: t**2, "accelerating", math.sqrt(2.0) - 1.0),
    "root": (np.sqrt, "decelerating", 3.0),
    "saturates": (lambda t: np.expm1(-3.0 * t) / math.expm1(-3.0), "saturating", math.inf),
    "kinks": (lambda t: np.where(t < 0.7, t, 5.0 * t - 2.8) / 2.2, "kinked", 2.2 / 5.0),
    "jumps": (lambda t: (t > 0.4) * 1.0, "jumps", math.inf),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_the_evidence_names_the_law_and_the_life_holds(shape: str) -> None:
    worn, law, life = SHAPES[shape]
    # the expected estimates: no chance is involved
    friction, sd = 1.0 + 0.5 * worn(TIME), np.full(TIME.size, 0.005)
    found = fit_laws(100.0 * TIME, friction, sd)
    assert found.probabilities[law] > 0.9
    reported = found.remaining_life(2.0)
    low, high = (reported.ppf(q) / 100.0 for q in (0.05, 0.95))
    assert low <= life <= high
    assert math.isinf(high) == math.isinf(life)


def test_two_points_leave_the_laws_of_smooth_wear_equally_probable() -> None:
    # every clock shows 0 and 1 there, so that nothing but what a law was given beforehand is left
    found = fit_laws(np.array([0.0, 3.0]), np.array([1.0, 1.2]), np.full(2, 0.01)).probabilities
    smooth = [found[law] for law in ("linear", "accelerating", "decelerating", "saturating", "kinked")]
    assert smooth == pytest.approx([smooth[0]] * 5, rel=1e-6)


def test_before_the_kink_wear_is_slower_by_the_ratio() -> None:
    rates = np.diff(KinkClock(0.6, 4.5).reading(np.array([0.0, 0.1, 0.6, 0.7, 1.0]))) / [0.1, 0.5, 0.1, 0.3]
    np.testing.assert_allclose(rates[1:] / rates[0], [1.0, 4.5, 4.5])


def test_steady_wear_alone_is_the_wear_model() -> None:
    friction, sd = 1.0 + 0.5 * TIME, np.full(TIME.size, 0.005)
    found = fit_laws(TIME, friction, sd)
    (steady,) = [each for each in found.clocks if each.law == "linear"]
    alone = fit_wear(TIME, friction, sd, default_wear_prior(TIME, friction))
    assert steady.posterior.moments("drift") == alone.moments("drift")
    ours, theirs = found.remaining_life(2.0), remaining_life(alone, 2.0, 1.0)
    assert ours.ppf(0.5) == pytest.approx(theirs.ppf(0.5), rel=0.02)


def test_the_unit_of_time_does_not_matter() -> None:
    friction, sd = 1.0 + 0.5 * TIME**1.5, np.full(TIME.size, 0.01)
    days, seconds = (fit_laws(unit * TIME, friction, sd) for unit in (1.0, 86400.0))
    assert days.probabilities == pytest.approx(seconds.probabilities, rel=1e-6)
    assert days.moments("drift")[0] == pytest.approx(86400.0 * seconds.moments("drift")[0], rel=1e-6)
    lives = [each.remaining_life(2.0).ppf(0.5) for each in (days, seconds)]
    assert lives[1] == pytest.approx(86400.0 * lives[0], rel=1e-6)


def test_further_jumps_are_negative_binomial(rng: np.random.Generator) -> None:
    # three jumps of one half each so far: the next two lead over the threshold
    clock = JumpClock((0.2, 0.4, 0.7))
    reading = clock.reading(TIME)
    friction, sd = 1.0 + 1.5 * reading, np.full(TIME.size, 1e-6)
    prior = default_wear_prior(TIME, friction)
    wear = fit_wear(reading, friction, sd, type(prior)(wander=0.0, scatter=1e-9))
    life = remaining_life(wear, 3.2, 1.0)
    n = 20_000
    rate = rng.gamma(3.5, 1.0, n)
    come = rng.poisson(rate * 0.5) >= 2
    # five standard errors
    found = float(clock.reached(life, np.array([1.5]))[0])
    assert found == pytest.approx(come.mean(), abs=2.5 / math.sqrt(n))


def machine(friction: Array) -> DetectionPoints:
    return DetectionPoints(
        times=np.arange(float(friction.size)),
        time_unit="h",
        friction=friction,
        sd=np.full(friction.size, 0.01),
        unit="N",
        relative_sd=0.0,
    )


def test_a_crossing_that_was_repaired_is_reported() -> None:
    report = follow(machine(np.array([0.5, 0.8, 1.1, 1.2, 0.5, 0.55])), 1.0)
    assert report.repaired_crossings == ["T3", "T4"]
    assert "at T3 to T4 and has fallen below it again" in report.advice()["text"]
    reported = report.to_dict()["prognostic_assessment"]
    assert reported["repaired_crossings"] == ["T3", "T4"]
    ahead = reported["not_reached_within_horizon"]
    assert ahead["horizon"] == 50.0
    assert reported["probability_never_reached"] <= ahead["probability"] <= 1.0


@pytest.mark.parametrize("friction", [[0.5, 0.6, 0.7, 0.8], [0.7, 0.9, 1.1, 1.2], [0.7, 0.8, 1.005, 0.9]])
def test_no_repair_is_reported_where_none_was(friction: list[float]) -> None:
    report = follow(machine(np.array(friction)), 1.0)
    assert report.repaired_crossings == []
    assert "repair" not in report.advice()["text"]
