from __future__ import annotations

import ast
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from experiments import ordinary_records
from experiments.ordinary import judged as judging
from experiments.ordinary.coulomb_motion import CoulombMotion
from experiments.ordinary.judged import ESTIMATORS, VERDICT, judged
from experiments.ordinary.processing import (
    ac_coupling,
    causal_low_pass,
    differentiated,
    gain_at,
    integrated_twice,
    moving_mean,
    savitzky_golay,
    straight_lines,
    zero_phase_low_pass,
)
from experiments.ordinary.recipes import RECIPES
from experiments.ordinary.recording import Layout, draw_layout, recorded
from experiments.ordinary.rig import SENSORS, OrdinaryRecord, Rig
from experiments.ordinary.table import short
from experiments.ordinary_records import EXPERIMENT, Config, score

RIG = Rig(mass=10.0, stiffness=1000.0, friction=1.0)
LAYOUT = Layout(rig=RIG, amplitude=0.05, begin=0.3, step=0.005, samples=800)
MOTION = CoulombMotion(RIG, 0.05)
GENERATORS = Path(ordinary_records.__file__).parent / "ordinary"
RESULTS = {"judged.py", "table.py", "__main__.py"}


def test_generators_share_nothing_with_the_package() -> None:
    for path in GENERATORS.glob("*.py"):
        if path.name in RESULTS:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [each.name for each in node.names] if isinstance(node, ast.Import) else []
            for name in names:
                assert not name.startswith("friction_bayes"), path.name
                assert not name.startswith("experiments.") or name.startswith("experiments.ordinary.")


@pytest.mark.parametrize(
    ("process", "cycles_a_sample", "expected"),
    [
        (causal_low_pass(16.0, 100.0), 0.16, math.sqrt(0.5)),
        (zero_phase_low_pass(16.0, 100.0), 0.16, 0.5),
        (savitzky_golay(21), 0.051, math.sqrt(0.5)),
        (moving_mean(9), 0.443 / 9.0, math.sqrt(0.5)),
        (ac_coupling(3.0, 100.0), 0.03, math.sqrt(0.5)),
        (straight_lines(10), 0.01, np.sinc(0.1) ** 2),
    ],
)
def test_filters_pass_what_they_should(process, cycles_a_sample: float, expected: float) -> None:
    assert gain_at(process, 2.0 * math.pi * cycles_a_sample, 1.0) == pytest.approx(expected, rel=0.02)


def test_differences_and_integrals_are_those_of_an_oscillation() -> None:
    w, step = 3.0, 0.01
    t = step * np.arange(2000)
    np.testing.assert_allclose(
        differentiated(2, step)(np.cos(w * t))[5:-5], -(w**2) * np.cos(w * t)[5:-5], rtol=0, atol=0.01
    )
    assert gain_at(differentiated(1, step), w, step, 1) == pytest.approx(np.sin(w * step) / (w * step))
    assert gain_at(integrated_twice(step), w, step, -2) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_record_is_the_motion_from_its_beginning_with_noise(sensor: str, rng: np.random.Generator) -> None:
    record = recorded(rng, LAYOUT, MOTION, sensor, snr_db=40.0)
    clean = MOTION.sample(0.3 + record.times, sensor)
    noise = record.values - clean
    # 800 samples: the sd of a standard deviation is 2.5 %
    assert noise.std() == pytest.approx(0.01 * clean.std(), rel=0.12)
    assert record.truth is not None
    assert record.truth(0.0, 1.0) == 1.0


def test_a_margin_leaves_no_transient_of_the_filter(rng: np.random.Generator) -> None:
    def values(margin: int) -> np.ndarray:
        settings = {"noise_sd": 0.0, "process": causal_low_pass(2.0, 200.0), "margin": margin}
        return recorded(rng, LAYOUT, MOTION, "velocity", **settings).values

    # 0.3 s before the record are 60 samples of motion, before that the mass is held
    np.testing.assert_allclose(values(200), values(70), rtol=0, atol=1e-12)
    assert np.max(np.abs(values(200) - values(0))) > 0.01
    np.testing.assert_allclose(values(200)[-100:], values(0)[-100:], rtol=0, atol=1e-9)


def test_layouts_leave_four_half_cycles_of_motion(rng: np.random.Generator) -> None:
    for _ in range(100):
        layout = draw_layout(rng)
        motion = CoulombMotion(layout.rig, layout.amplitude)
        turns = math.pi / layout.rig.frequency * np.arange(1, motion.turning_points.size)
        assert np.count_nonzero(turns > layout.begin) >= 3
        assert 59.0 < layout.per_period < 501.0
        assert 3.9 < layout.samples * layout.step / layout.rig.period * 2.0 < 61.0


@pytest.mark.parametrize("name", RECIPES)
def test_a_recipe_draws_the_same_record_again(name: str, seed: int) -> None:
    first, again = (RECIPES[name](np.random.default_rng(seed), 4) for _ in range(2))
    np.testing.assert_array_equal(first.values, again.values)
    other = RECIPES[name](np.random.default_rng(seed + 1), 4)
    assert other.values.size != first.values.size or np.any(other.values != first.values)
    assert np.all(np.isfinite(first.values))
    np.testing.assert_allclose(np.diff(first.times), first.times[1], rtol=1e-9)
    if name == "steady drive alone":
        assert first.truth is None
    else:
        assert first.truth is not None
        assert first.truth(0.0, float(first.times[-1])) > 0.0


def test_the_fixed_recipes_are_as_written() -> None:
    record = RECIPES["short, one accelerometer"](np.random.default_rng(0), 0)
    assert (record.mass, record.stiffness, record.quantity) == (1.0, 400.0, "acceleration")
    assert record.truth is not None
    assert record.truth(0.0, 0.5) == 0.31111
    # (k x - r) / m at the release, within noise of 0.012
    assert record.values[0] == pytest.approx(-(400.0 * 0.01 - 0.31111), abs=0.06)
    record = RECIPES["10 kg: displacement, zero phase at 8 Hz"](np.random.default_rng(0), 0)
    assert record.times[-1] == pytest.approx(11.99)
    assert record.values[300] == pytest.approx(
        float(MOTION.sample(np.array([3.0]), "displacement")[0]), abs=1e-3
    )


def test_few_samples_are_few(seed: int) -> None:
    sizes = [RECIPES["few samples"](np.random.default_rng(seed + i), i).values.size for i in range(30)]
    assert min(sizes) >= 20
    assert max(sizes) <= 63


def plain_record(rng: np.random.Generator) -> OrdinaryRecord:
    return recorded(rng, LAYOUT, MOTION, "displacement", snr_db=40.0)


def test_a_plain_record_is_judged_right(rng: np.random.Generator) -> None:
    verdict = judged(plain_record(rng))
    assert set(verdict) == set(VERDICT)
    for i in range(3):
        assert verdict["refused"][i] == 0.0
        assert verdict["ratio"][i] == pytest.approx(1.0, abs=0.02)
        assert verdict["off"][i] == 0.0


def test_the_truth_is_that_of_the_part_that_was_fitted(rng: np.random.Generator) -> None:
    asked = []
    record = plain_record(rng)

    def truth(start: float, stop: float) -> float:
        asked.append((start, stop))
        return 2.0

    sealed = OrdinaryRecord(**{**record.__dict__, "truth": truth})
    verdict = judged(sealed)
    assert verdict["ratio"][0] == pytest.approx(0.5, abs=0.01)
    assert verdict["covered"][0] == 0.0
    assert verdict["off"][0] == 1.0
    estimate = fb.estimate(
        fb.records.record.make_record(record.times, record.values, "displacement"),
        fb.Oscillator(mass=10.0, stiffness=1000.0),
    )
    first = estimate.decay.start_time
    assert asked[0] == pytest.approx((first, first + estimate.decay.time[-1]))


def test_a_witness_is_judged_where_there_is_one(rng: np.random.Generator, monkeypatch) -> None:
    reported = fb.estimate(
        fb.simulate(
            fb.Oscillator(mass=10.0, stiffness=1000.0),
            friction=1.0,
            initial_displacement=0.05,
            duration=4.0,
            sampling_rate=200.0,
            noise_sd=1e-4,
            seed=1,
        ),
        fb.Oscillator(mass=10.0, stiffness=1000.0),
    )
    summary = reported.to_dict()
    heard = {"friction": {"mean": 0.9, "interval90": [0.8, 0.95]}, "agrees": False}

    class Estimate:
        decay = reported.decay

        def to_dict(self) -> dict[str, object]:
            return summary | {"witness": heard}

    monkeypatch.setattr(judging.fb, "estimate", lambda *args, **options: Estimate())
    verdict = judged(plain_record(rng))
    i = ESTIMATORS.index("witness")
    assert verdict["ratio"][i] == pytest.approx(0.9)
    assert verdict["width"][i] == pytest.approx(0.15)
    assert (verdict["covered"][i], verdict["off"][i], verdict["agrees"][i]) == (0.0, 0.0, 0.0)


def test_a_record_without_decay_has_no_friction(rng: np.random.Generator) -> None:
    t = 0.01 * np.arange(1000)
    values = rng.standard_normal(t.size)
    noise = OrdinaryRecord(
        times=t, values=values, quantity="displacement", mass=1.0, stiffness=100.0, truth=None
    )
    verdict = judged(noise)
    assert verdict["refused"] == [1.0] * len(ESTIMATORS)
    assert np.all(np.isnan(verdict["ratio"]))


def made_up(row: str, ratio: dict[str, float]) -> xr.Dataset:
    cells = [{"row": row, "replicate": i} for i in range(4)]
    result = {name: [math.nan] * len(ESTIMATORS) for name in VERDICT}
    for label, value in ratio.items():
        i = ESTIMATORS.index(label)
        result["ratio"][i], result["width"][i], result["refused"][i] = value, 0.1, 0.0
        result["covered_in_signal"][i] = result["covered"][i] = float(abs(value - 1.0) < 0.05)
        result["off"][i], result["warned"][i] = float(abs(value - 1.0) > 0.1), 0.0
    for label in set(ESTIMATORS) - set(ratio):
        result["refused"][ESTIMATORS.index(label)] = 1.0
    facts = dict.fromkeys(ordinary_records._FACTS, 1.0)
    return EXPERIMENT.assemble(cells, [{**result, **facts}] * 4)


def test_the_table_says_which_estimate_is_nearest() -> None:
    dataset = made_up("x", {"default": 0.7, "no random force": 1.001, "envelope": 0.97})
    row, everywhere, wrong = EXPERIMENT.rows(dataset)
    assert row.ours.startswith("covers 0 ")
    assert "0.700 of the truth" in row.ours
    assert row.remark.startswith("nearest: no random force, off by 0.1 % (median), the default by 30 %")
    assert (everywhere.ours[:4], everywhere.paper[:4]) == ("100 ", "0 ± ")
    assert (wrong.ours, wrong.remark) == ("1", "x")
    lines = EXPERIMENT.details(dataset)
    assert [line["estimate"] for line in lines] == ["default", "no random force", "envelope"]
    assert lines[0]["a whole interval off, %"].startswith("100")
    assert lines[0]["width / no force's"] == "1"
    assert [short(value) for value in (0.0123, 3.14, 99.9, 1234.5)] == ["0.012", "3.1", "100", "1234"]


def test_a_row_that_was_refused_says_so() -> None:
    row, *_ = EXPERIMENT.rows(made_up("steady drive alone", {}))
    assert row.ours == "4 of 4 refused"


def test_scores_of_chosen_rows_are_printed_once_a_row(capsys: pytest.CaptureFixture[str]) -> None:
    dataset = score(["few"], records=1)
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].startswith("| record | estimate |")
    assert printed[2].startswith("| few samples | default | 1 |")
    assert dataset.sizes["replicate"] == 1
    with pytest.raises(ValueError, match="no row begins with"):
        score(["nothing of that name"])


def test_cells_go_round_the_sensors_evenly() -> None:
    config = Config()
    assert config.records % 3 == config.records_full % 27 == 0
    assert len(EXPERIMENT.cells(config, True)) == 54 * len(RECIPES)
