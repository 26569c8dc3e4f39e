from __future__ import annotations

import ast
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from experiments.blind.draws import CATALOGUE, EXCLUSIVE, pairs
from experiments.blind.fitting import fit_set, physical_parameters
from experiments.blind.forward import decay_signal
from experiments.blind.generator import (
    HALF_CYCLES,
    KINDS,
    PAIR_KINDS,
    SAMPLES_PER_PERIOD,
    SIGNAL_TO_NOISE_DB,
    draw,
    trace_of,
)
from experiments.blind.identifiable import closest_rival, problem_of, sealed_record
from experiments.blind.laws import Law, integrate
from experiments.blind.outliers import deviance_of_outliers, deviance_with_outliers

ROOT = Path(__file__).parents[3]
BLIND = sorted((ROOT / "experiments" / "blind").glob("*.py"))
ALLOWED = {"numpy", "scipy", "numba", "xarray", "experiments"} | sys.stdlib_module_names


@pytest.mark.parametrize("path", BLIND, ids=lambda path: path.stem)
def test_generator_shares_no_code_with_the_fitted_model(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module == "friction_bayes":
            assert [alias.name for alias in node.names] == ["make_record"]
        elif isinstance(node, ast.ImportFrom):
            assert node.module is not None
            assert node.module.split(".")[0] in ALLOWED
            assert not node.module.startswith("experiments") or node.module.startswith("experiments.blind.")
        elif isinstance(node, ast.Import):
            assert {alias.name.split(".")[0] for alias in node.names} <= ALLOWED


def test_generator_loads_neither_mechanics_nor_loop() -> None:
    script = (
        "import sys; from experiments.blind.generator import draw; draw('plain_coulomb', 1)\n"
        "print([m for m in sys.modules if m.startswith(('friction_bayes.mechanics', 'friction_bayes.loop'))])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.strip() == "[]"


def test_coulomb_decay_matches_the_closed_form() -> None:
    d = 0.0202
    motion = integrate(Law(friction=d), 1.0, 0.0, 100.0)
    # turning points at 1 - 2 d n, half cycles of length pi, stop at the first one within d
    drops = 25  # 1 - 2 d n first lies within d
    np.testing.assert_allclose(motion.turning_times, math.pi * np.arange(1, drops + 1), rtol=0, atol=1e-8)
    at_turns, _ = motion.sample(motion.turning_times)
    expected = (1.0 - 2.0 * d * np.arange(1, drops + 1)) * (-1.0) ** np.arange(1, drops + 1)
    np.testing.assert_allclose(at_turns, expected, rtol=0, atol=1e-8)
    assert motion.rest_time == pytest.approx(math.pi * drops, abs=1e-8)


def test_smooth_damping_matches_the_closed_form_between_two_turning_points() -> None:
    zeta, d = 0.03, 0.01
    motion = integrate(Law(friction=d, damping_ratio=zeta), 1.0, 0.0, 3.0)
    t = np.linspace(0.0, 3.0, 50)
    wd = math.sqrt(1.0 - zeta**2)
    expected = d + (1.0 - d) * np.exp(-zeta * t) * (np.cos(wd * t) + zeta / wd * np.sin(wd * t))
    np.testing.assert_allclose(motion.sample(t)[0], expected, rtol=0, atol=1e-9)


def test_asymmetric_friction_is_a_shift_of_the_centre_and_invisible_in_acceleration() -> None:
    d, e = 0.012, 0.4
    t = np.linspace(0.0, 130.0, 4000)
    x, acceleration = integrate(Law(friction=d, asymmetry=e), 1.0 - e * d, 0.0, 130.0).sample(t)
    plain_x, plain_acceleration = integrate(Law(friction=d), 1.0, 0.0, 130.0).sample(t)
    np.testing.assert_allclose(x, plain_x - e * d, rtol=0, atol=1e-8)
    np.testing.assert_allclose(acceleration, plain_acceleration, rtol=0, atol=1e-7)
    assert trace_of(("asymmetric_friction", "outliers"), "acceleration") == ("outliers",)
    assert trace_of(("asymmetric_friction",), "angle") == ("asymmetric_friction",)
    assert len(trace_of(("asymmetric_friction", "friction_drift"), "acceleration")) == 2


def test_a_mass_at_rest_is_freed_when_the_support_slips() -> None:
    law = Law(friction=0.1, base_slips=(20.0,), base_slip=0.5)
    motion = integrate(law, 0.05, 0.0, 40.0)
    x, acceleration = motion.sample(np.array([0.0, 19.9, 20.0 + math.pi / 2.0, 39.0]))
    assert x[0] == x[1] == 0.05
    assert acceleration[1] == 0.0
    # swings about -0.5 + 0.1 while it moves down
    assert x[2] == pytest.approx(-0.4, abs=1e-8)
    assert motion.rest_time is not None
    assert motion.rest_time > 20.0


@pytest.mark.parametrize("order", [0, 2])
def test_fast_forward_model_agrees_with_dop853(order: int) -> None:
    law = Law(
        friction=0.009,
        damping_ratio=0.001,
        drag=0.002,
        asymmetry=0.3,
        static_excess=0.8,
        stribeck_velocity=0.2,
        relative_change=0.5,
        cubic=0.05,
        duration=150.0,
    )
    t = np.arange(0.0, 150.0, 0.05)
    start = (0.6, -0.8)
    reference = integrate(law, *start, 150.0).sample(t)[order // 2]
    p = np.array([1.0, 0.009, *start, 0.001, 0.002, 0.3, 0.8, math.log(0.2), 0.5, 0.05])
    fast = decay_signal(p, t, 150.0, order)
    # around a turning point the acceleration jumps: a sample may lie on the other side
    difference = np.sort(np.abs(fast - reference))[: t.size - (60 if order else 0)]
    # phase runs ahead by h^4 / 120 a radian, 1.9e-3 at the end: what a free frequency takes up
    assert difference[-1] < 2.5e-3
    assert np.sqrt(np.mean(difference**2)) < 6e-4


@pytest.mark.parametrize(
    "kind", ["plain_coulomb", "sensor_clipping", "outliers", "friction_drift", "second_mode"]
)
def test_record_carries_nothing_of_its_truth(kind: str, seed: int) -> None:
    sealed = draw(kind, seed)
    assert set(sealed.record.attrs) == {"quantity", "units", "name", "synthetic"}
    assert sealed.record.attrs["name"] == "sealed record"
    assert sealed.record.attrs["synthetic"] is True
    assert set(sealed.system) in ({"mass", "stiffness"}, {"inertia", "stiffness"})
    assert (sealed.truth.quantity == "angle") == ("inertia" in sealed.system)


def test_draws_stay_in_the_stated_ranges_and_repeat(seed: int) -> None:
    kinds = KINDS[::3]
    mid_motion = []
    for number, kind in enumerate(kinds):
        truth = draw(kind, seed + number).truth
        assert HALF_CYCLES[0] <= truth.half_cycles <= HALF_CYCLES[1]
        assert SIGNAL_TO_NOISE_DB[0] <= truth.snr_db <= SIGNAL_TO_NOISE_DB[1]
        assert SAMPLES_PER_PERIOD[0] <= truth.samples_per_period <= SAMPLES_PER_PERIOD[1]
        mid_motion.append(truth.mid_motion)
    assert 0 < sum(mid_motion) < len(kinds)
    first, again, other = (draw("sensor_drift", s) for s in (seed, seed, seed + 1))
    np.testing.assert_array_equal(first.record, again.record)
    assert first.truth == again.truth
    assert other.truth.noise_sd != first.truth.noise_sd


def test_noise_has_the_stated_level(seed: int) -> None:
    sealed = draw("plain_coulomb", seed)
    clean = sealed.clean * sealed.truth.noise_sd / sealed.noise_sd
    residual = (sealed.record.values - clean) / sealed.truth.noise_sd
    n = residual.size
    assert abs(residual.mean()) < 4.5 / math.sqrt(n)
    assert abs(residual.std() - 1.0) < 4.5 / math.sqrt(2.0 * n)


def test_clipped_records_hold_flat_samples(seed: int) -> None:
    sealed = draw("sensor_clipping", seed)
    top = np.abs(sealed.record.values)
    assert np.sum(top == top.max()) > 5


def test_pairs_never_hold_one_effect_twice() -> None:
    drawn = [frozenset(pair) for kind in PAIR_KINDS for pair in pairs(kind)]
    assert len(drawn) == len(set(drawn)) == math.comb(len(CATALOGUE), 2) - len(EXCLUSIVE)
    assert not set(drawn) & set(EXCLUSIVE)


def test_unknown_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown kind 'wear', one of plain_coulomb"):
        draw("wear", 1)


def test_identical_signals_are_found_out(seed: int) -> None:
    sealed = draw("asymmetric_friction", seed)
    shift = 0
    while sealed.truth.quantity == "acceleration":
        shift += 1
        sealed = draw("asymmetric_friction", seed + shift)
    loss, rival = closest_rival(sealed, 1)
    assert loss < 0.1
    assert rival in ({"sensor_offset"}, {"sensor_drift"})


def test_strong_effects_are_identifiable_and_a_plain_record_has_no_rival(seed: int) -> None:
    _, loss, rival = sealed_record("cubic_stiffness", seed)
    assert loss > 10.0
    assert rival != {"cubic_stiffness"}
    assert sealed_record("plain_coulomb", seed)[1] == math.inf


def test_outside_the_catalogue_is_drawn_until_no_pair_explains_it(seed: int) -> None:
    sealed, loss, _ = sealed_record("stick_slip_base", seed)
    assert loss >= 200.0
    assert sealed.truth.outside


def test_fit_finds_the_truth_from_a_smaller_model(seed: int) -> None:
    sealed = draw("quadratic_drag", seed)
    problem = problem_of(sealed)
    guess = physical_parameters(
        frequency=sealed.frequency,
        friction=1.1 * sealed.motion.law.friction,
        displacement=sealed.start[0],
        velocity=sealed.start[1],
    )
    coulomb, base = fit_set(problem, frozenset(), {}, guess)
    loss, p = fit_set(problem, frozenset({"quadratic_drag"}), {frozenset(): base}, guess)
    assert loss < min(coulomb, 0.5)
    assert p[5] == pytest.approx(sealed.motion.law.drag, rel=0.02, abs=1e-5)
    assert p[1] == pytest.approx(sealed.motion.law.friction, rel=0.005)


def test_expected_deviances_of_outliers(rng: np.random.Generator) -> None:
    assert deviance_with_outliers(np.zeros(500), 1.0) == pytest.approx(0.0, abs=0.5)
    # a misfit of one constant cannot hide in the tails: it widens the noise, n log(1 + misfit^2)
    assert deviance_with_outliers(np.full(400, 0.5), 10.0) == pytest.approx(4000 * math.log(1.25), rel=0.02)
    # a misfit of a few far samples can
    sparse = np.zeros(400)
    sparse[::100] = 30.0
    assert deviance_with_outliers(sparse, 1.0) < 0.1 * np.sum(sparse**2)
    n, fraction, scale = 400_000, 0.02, 10.0
    z = rng.normal(size=n) * np.where(rng.random(n) < fraction, scale, 1.0)
    mixture = np.log((1 - fraction) * np.exp(-(z**2) / 2) + fraction / scale * np.exp(-(z**2) / 2 / scale**2))
    variance = 1 - fraction + fraction * scale**2
    terms = 2.0 * (mixture + 0.5 * np.log(variance) + z**2 / 2 / variance)
    expected = deviance_of_outliers(n, fraction, scale)
    assert abs(terms.sum() - expected) < 4.5 * terms.std() * math.sqrt(n)
