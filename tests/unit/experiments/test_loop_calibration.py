"""Records drawn from the loop's own priors: the draws, their simulation, and the table of what comes out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import solve_ivp

from experiments import loop_calibration, loop_priors
from experiments.blind.hidden import nats_against, seen
from experiments.blind.laws import Law, integrate
from experiments.blind.prior_drawn import (
    AddedLaw,
    Sensor,
    measure,
    move,
    pushed_share,
    reading,
    release,
    shows_a_decay,
)
from experiments.blind.sensor_faults import with_sensor
from experiments.loop_calibration import place_of_truth, rank_test, reliability, rows
from experiments.loop_priors import NAMES, RANDOM_FORCE, SLIGHT, Setting, draw, draw_effects, offered
from friction_bayes.loop.infer.law_along_motion import force_prior
from friction_bayes.loop.settings import SETTINGS
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.inclusion import inclusion

SETTING = Setting(
    quantity="displacement",
    swing=0.01,
    half_cycles=20,
    samples_per_period=40.0,
    snr_db=30.0,
    phase=0.0,
    natural_frequency=10.0,
    moving=2.0,
)


def test_a_seed_decides_the_record(seed: int) -> None:
    first, again, other = draw(seed), draw(seed), draw(seed + 1)
    np.testing.assert_array_equal(first.record.values, again.record.values)
    assert first.effects == again.effects
    assert first.record.shape != other.record.shape or not np.array_equal(first.record, other.record)


def test_effects_act_as_often_as_the_loop_states(rng: np.random.Generator) -> None:
    names = offered(SETTING)
    assert "position_force" not in names
    n = 4000
    drawn = [draw_effects(names, rng) for _ in range(n)]
    often = sum("viscous_damping" in each for each in drawn)
    # sets that the loop does not form are drawn again, so less often, most of all where many act: 4 sd
    expected = inclusion()
    assert 0.6 * expected * n < often < (expected + 4.0 * math.sqrt(expected / n)) * n
    none = sum(set(each) <= {RANDOM_FORCE} for each in drawn) / n
    assert 0.45 < none < 0.65
    assert not any({"sensor_offset", "sensor_drift"} <= set(each) for each in drawn)


@pytest.mark.parametrize("name", NAMES)
def test_parameters_come_from_the_stated_prior(name: str, rng: np.random.Generator) -> None:
    if name in (RANDOM_FORCE, "second_mode"):
        pytest.skip("drawn with the friction, or where it can be separated from the motion's harmonics")
    setting = replace(SETTING, quantity="angle", swing=2.0)
    drawn = np.array([loop_priors._draw_parameters(name, setting.scales, rng)[0] for _ in range(300)])
    prior = EFFECTS[name].priors(setting.scales)[0]
    widths = EFFECTS[name].widths
    if widths == (1.0,):
        # false alarm 1e-4 for each of twenty
        assert stats.kstest(drawn, prior.distribution.cdf).pvalue > 1e-4
    else:
        assert np.std(drawn) > 3.0 * prior.scale


def test_a_plain_law_moves_as_the_exact_one() -> None:
    motion = move(AddedLaw(friction=0.02, duration=60.0), release(0.0), None, np.random.default_rng(1))
    times = np.linspace(0.0, 59.0, 500)
    exact = integrate(Law(friction=0.02, duration=60.0), 1.0, 0.0, 60.0)
    for mine, theirs in zip(motion.sample(times), exact.sample(times), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-6)
    assert shows_a_decay(motion)


def test_changes_of_friction_add_up() -> None:
    law = AddedLaw(
        friction=0.02,
        duration=40.0,
        asymmetry=0.1,
        relative_change=0.5,
        friction_tilt=0.2,
        friction_bend=-0.4,
    )
    motion = move(law, release(0.0), None, np.random.default_rng(1))

    def slope(t: float, y: np.ndarray) -> tuple[float, float]:
        sign = -1.0 if np.searchsorted(motion.turning_times, t, side="right") % 2 == 0 else 1.0
        level = 1.0 + 0.1 * sign + 0.5 * (t / 40.0 - 0.5) + 0.2 * y[0] - 0.4 * y[0] ** 2
        return y[1], -y[0] - 0.02 * sign * level

    dense = solve_ivp(slope, (0.0, 30.0), (1.0, 0.0), max_step=0.01, rtol=1e-9, atol=1e-11, dense_output=True)
    times = np.linspace(0.0, 29.0, 300)
    np.testing.assert_allclose(motion.sample(times)[0], dense.sol(times)[0], rtol=0, atol=1e-6)
    assert pushed_share(motion) == 0.0
    assert (
        pushed_share(move(replace(law, friction_bend=-2.0), release(0.0), None, np.random.default_rng(1)))
        > 0.1
    )


def test_the_sensor_shows_what_it_is_given() -> None:
    motion = move(AddedLaw(friction=0.01, duration=40.0), release(0.0), None, np.random.default_rng(1))
    times, rng = np.arange(0.0, 40.0, 0.1), np.random.default_rng(2)
    clean, clipped = measure(motion, Sensor(order=0), times, 0.0, rng)
    assert clipped == 0
    velocity, _ = measure(motion, Sensor(order=1), times, 0.0, rng)
    np.testing.assert_allclose(velocity[1:-1], np.gradient(clean, times)[1:-1], atol=3e-3)
    lagging, _ = measure(motion, Sensor(order=0, lag=0.02), times, 0.0, rng)
    np.testing.assert_allclose(lagging - clean, -0.02 * np.sign(velocity), atol=1e-12)
    turned = Sensor(order=0, swing=2.0, turn_sines=(0.0, 0.1), turn_cosines=(0.3, 0.0))
    shown, _ = measure(motion, turned, times, 0.0, rng)
    error = 0.1 * np.sin(4.0 * clean) + 0.3 * np.cos(2.0 * clean)
    np.testing.assert_allclose(shown - clean, error, atol=1e-12)
    held, clipped = measure(motion, Sensor(order=0, clipping=0.5), times, 0.0, rng)
    assert clipped == np.sum(np.abs(clean) > 0.5)
    assert np.abs(held).max() == 0.5


def test_the_place_of_the_truth_is_spread_over_draws_that_equal_it(rng: np.random.Generator) -> None:
    assert 0.5 <= place_of_truth(np.array([1.0, 2.0, 3.0]), 2.5, rng) <= 0.75
    places = [place_of_truth(np.zeros(9), 0.0, rng) for _ in range(400)]
    assert stats.kstest(places, "uniform").pvalue > 1e-3


def test_small_form(seed: int) -> None:
    cells = loop_calibration.cells(loop_calibration.Config(records=2), False)
    found = [
        loop_calibration.run(loop_calibration.Config(), cell, np.random.SeedSequence([seed, i]))
        for i, cell in enumerate(cells)
    ]
    dataset = loop_calibration.assemble(cells, found)
    assert dataset.sizes == {"record": 2, "effect": len(NAMES)}
    many = dataset.isel(record=np.arange(200) % 2)
    places = (np.arange(200) + 0.5) / 200
    many = many.assign(place=("record", places), verdict=("record", np.full(200, "adequate")))
    covered = (places > 0.05) & (places < 0.95)
    many = many.assign(covered=("record", covered.astype(float)))
    probabilities = np.where(many["offered"].values > 0.0, 0.1, np.nan)
    many = many.assign(probabilities=(("record", "effect"), probabilities))
    assert not rank_test(many).failed
    table = {row.what: row for row in rows(many)}
    assert table["all records"].ours.startswith("covers 90")
    assert table["ranks of friction"].ours == "uniform"
    bins = reliability(many)
    assert bins["n"].values.tolist() == [0, int(many["offered"].sum()), 0, 0, 0, 0]
    shifted = many.assign(place=("record", places**2))
    assert {row.what: row for row in rows(shifted)}["ranks of friction"].ours == "not uniform"


@pytest.mark.parametrize(("order", "phase"), [(0, 0.0), (2, 2.0)])
def test_strength_of_a_tenth_of_a_standard_deviation_costs_a_hundredth_of_chi_square(
    order: int, phase: float
) -> None:
    law = AddedLaw(friction=0.01, duration=60.0)
    times = np.linspace(0.0, 59.9, 400)
    clean = seen(law, release(phase), order, times, 0.02)

    def plain(p: np.ndarray) -> np.ndarray:
        law = AddedLaw(friction=0.01 * (1.0 + p[0]), duration=60.0)
        start = tuple(np.array(release(phase)) + p[2:])
        return replace(clean, law=law, start=start).signal(1.0 + p[1]) / 0.02

    steps = 1e-4 * np.array([1.0, -1.0, 1.0, 1.0])
    slopes = np.column_stack([(plain(step) - plain(np.zeros(4))) for step in np.diag(steps)]) / steps
    for strength in SLIGHT.values():
        there = 0.1 * clean.sd_of(strength, None)
        signal = replace(clean, law=replace(law, **{strength: there})).signal() / 0.02
        p = np.zeros(4)
        for _ in range(3):
            p += (further := np.linalg.lstsq(slopes, signal - plain(p), rcond=None)[0])
        assert np.linalg.norm(further) < 1e-2 * np.linalg.norm(p)
        loss = np.sum((signal - plain(p)) ** 2)
        # damping is not quite linear
        assert loss == pytest.approx(0.01, rel=0.1), strength


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_small_force_has_the_covariance_of_its_paths(order: int) -> None:
    law, force = AddedLaw(friction=0.0, duration=20.0), (1e-3, 1.0)
    looked_at = seen(law, release(1.0), order, np.linspace(0.0, 19.9, 200), 1e-3)
    clean, rng = looked_at.signal(), np.random.default_rng(4)
    n = 150
    paths = [
        reading(move(law, looked_at.start, force, rng), order, looked_at.times) - clean for _ in range(n)
    ]
    ours = force[0] ** 2 * looked_at.force_covariance(force[1])
    weights = np.random.default_rng(5).standard_normal((3, clean.size))
    sampled = np.var(np.array(paths) @ weights.T, axis=0)
    stated = np.einsum("ij,jk,ik->i", weights, ours, weights)
    # a variance from n paths is known to sqrt(2 / n): 3.5 of these, and the rule that sums the response
    assert np.all(np.abs(sampled / stated - 1.0) < 3.5 * math.sqrt(2.0 / n) + 0.03)


def test_evidence_against_a_force_is_what_plain_records_have() -> None:
    looked_at = seen(
        AddedLaw(friction=0.01, duration=60.0), release(0.0), 0, np.linspace(0.0, 59.9, 200), 0.02
    )
    variances = looked_at.force_variances(0.5)
    size = 0.02 / math.sqrt(float(variances.max())) * 60.0
    noise = np.random.default_rng(6).standard_normal((4000, variances.size))
    added = 1.0 + size**2 * variances
    log_ratio = 0.5 * (np.log(added) - noise**2 * (1.0 - 1.0 / added)).sum(axis=1)
    error = float(log_ratio.std()) / math.sqrt(log_ratio.size)
    assert nats_against(size, variances) == pytest.approx(float(log_ratio.mean()), abs=3.5 * error)
    assert 0.1 < nats_against(size, variances) < nats_against(2.0 * size, variances)
    # columns that are free take none of the force
    assert np.sum(variances < 1e-9 * variances.max()) >= looked_at.columns.shape[1]


def test_slight_effects_act_as_often_as_the_loop_states(rng: np.random.Generator) -> None:
    law = AddedLaw(friction=0.01, duration=SETTING.duration)
    times = np.linspace(0.0, 0.99 * SETTING.duration, 150)
    looked_at, prior = seen(law, release(0.0), 0, times, 0.02), force_prior(0.01)

    def drawn(acting: dict[str, tuple[float, ...]], n: int) -> list[dict[str, tuple[float, ...]]]:
        return [loop_priors._draw_slight(looked_at, SETTING, acting, prior, rng) for _ in range(n)]

    n, often = 150, SETTINGS.nuisance
    plain = drawn({}, n)
    for name, strength in SLIGHT.items():
        sizes = np.array([each[name][0] for each in plain if name in each])
        # 3.5 sd
        assert abs(sizes.size - often * n) < 3.5 * math.sqrt(n * often * (1.0 - often))
        width = SETTINGS.unseen * looked_at.sd_of(strength, None)
        assert abs(float(np.sqrt(np.mean(sizes**2))) / width - 1.0) < 3.5 / math.sqrt(2.0 * sizes.size)
    forces = [each[RANDOM_FORCE] for each in plain if RANDOM_FORCE in each]
    assert forces
    assert len(forces) < (often + 3.5 * math.sqrt(often * (1.0 - often) / n)) * n
    assert all(
        nats_against(size, looked_at.force_variances(tau)) <= 0.5 * SETTINGS.unseen**2 for size, tau in forces
    )
    acting: dict[str, tuple[float, ...]] = {"curved_friction_drift": (0.0, 0.1), RANDOM_FORCE: (1e-3, 1.0)}
    others = drawn(acting, n)
    assert not any({"friction_drift", RANDOM_FORCE} & set(each) for each in others)
    assert sum(bool(each) for each in others) < (inclusion() + 3.5 * math.sqrt(inclusion() / n)) * n


def test_friction_that_drifts_is_averaged_over_the_motion_alone(rng: np.random.Generator) -> None:
    law = AddedLaw(friction=0.05, duration=60.0, relative_change=0.4)
    motion = move(law, release(0.0), None, rng)
    assert motion.rest_time is not None
    expected = 1.0 + 0.4 * (0.5 * motion.rest_time / 60.0 - 0.5)
    assert loop_priors._mean_level(law, motion) == pytest.approx(expected, abs=1e-12)
    lasting = replace(law, friction=0.005)
    assert loop_priors._mean_level(lasting, move(lasting, release(0.0), None, rng)) == pytest.approx(1.0)


def test_a_zero_that_moves_along_a_curve_is_that_of_the_catalogue(rng: np.random.Generator) -> None:
    effect, drawn = EFFECTS["curved_sensor_drift"], (1e-3, 2e-4, -3e-5, 4e-6)
    sensor = loop_priors._sensor(SETTING, {"curved_sensor_drift": drawn})
    time = np.linspace(0.0, SETTING.duration, 50)
    shown = with_sensor(np.zeros(50), time, 1.0, 1.0, sensor.faults)
    zero = effect.distort(np.zeros(50), time, *drawn) / SETTING.swing
    np.testing.assert_allclose(shown, zero, rtol=0, atol=1e-9 * np.max(np.abs(zero)))
