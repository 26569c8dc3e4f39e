"""The experiments on measured records: laws carried to other segments, and the table's arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from experiments.loop_measured import NUMBERS, SERIES, TEXTS, assemble, rows
from experiments.pendulum_forecast import PUBLISHED_COEFFICIENT, Law, forecast, identified, published
from friction_bayes.loop.report.result import LoopReport

PENDULUM = fb.Pendulum(inertia=3.3e-3, stiffness=0.21)


def test_published_law_is_viscous() -> None:
    law = published(PENDULUM)
    zeta = law.effects["viscous_damping.damping_ratio"]
    # 2 zeta w0 I is the torque over the velocity
    assert 2.0 * zeta * PENDULUM.natural_frequency * PENDULUM.inertia == pytest.approx(PUBLISHED_COEFFICIENT)
    assert law.friction == 0.0


def test_forecast_of_the_true_law_has_no_error() -> None:
    law = Law(PENDULUM, 5e-4, {"quadratic_drag.drag_coefficient": 1.5e-5}, 8e-4)
    time = np.arange(3000) * 2e-3
    record = fb.make_record(time + 7.0, law.angle((0.6, -1.5), time), "angle", name="a segment")
    predicted, first = forecast(law, record)
    np.testing.assert_allclose(predicted, record.values, atol=1e-6)
    # a period of 0.6 rad is 2 % longer than that of small ones
    assert first * 2e-3 == pytest.approx(2.0 * np.pi / PENDULUM.natural_frequency, rel=0.04)
    wrong, _ = forecast(replace(law, friction=6e-4), record)
    assert np.abs(wrong - record.values)[first:].max() > 1e-3


def test_identified_law_is_the_posterior_median(loop_report: LoopReport) -> None:
    draws = {
        "friction": [4e-4, 6e-4],
        "log_frequency_ratio": [0.01, 0.03],
        "displacement[0]": [0.1, 0.1],
        "quadratic_drag.drag_coefficient": [1e-5, 3e-5],
        "sensor_offset.offset[0]": [1e-3, 1e-3],
        "sensor_offset.offset[1]": [3e-3, 3e-3],
    }
    posterior = xr.Dataset({name: (("chain", "draw"), [values]) for name, values in draws.items()})
    report = replace(loop_report, posterior=xr.DataTree.from_dict({"posterior": posterior}))
    law = identified(report, PENDULUM)
    assert law.friction == pytest.approx(5e-4)
    assert law.offset == pytest.approx(2e-3)
    assert law.effects == {"quadratic_drag.drag_coefficient": pytest.approx(2e-5)}
    ratio = law.system.natural_frequency / PENDULUM.natural_frequency
    assert ratio == pytest.approx(np.exp(0.02))


def results(names: Sequence[str], **columns: Sequence[Any]) -> xr.Dataset:
    """Results of as many records as are named, equal but for some columns."""
    reported = dict.fromkeys(NUMBERS, 1.0) | dict.fromkeys(TEXTS, "") | {name: [0.0, 1.0] for name in SERIES}
    reported |= {"candidates": '[{"effects": [], "probability": 1.0}]', "friction_after_low": 0.0}
    each = [reported | {name: values[k] for name, values in columns.items()} for k in range(len(names))]
    return assemble([{"record": name} for name in names], each)


def test_what_cannot_be_forecast_is_no_gain() -> None:
    names = [f"bicycle-wheel/{k}" for k in range(3)]
    table = rows(results(names, held_out_after=[0.1, 0.2, float("nan")]))
    assert table[0].ours == "0.2"
    assert table[0].remark == "reached"
    assert (table[1].ours, table[1].remark) == ("1", "reached")
    assert [row.what for row in table[-3:]] == names


def test_a_forecast_is_set_beside_what_its_law_expects() -> None:
    names = [f"bicycle-wheel/{k}" for k in range(3)]
    expected = rows(results(names, held_out_expected=[0.1, 0.4, float("nan")], held_out_before=[0.5] * 3))[2]
    assert expected.ours == "0.5"


def test_the_band_is_pooled_over_samples() -> None:
    names = [f"bicycle-wheel/{k}" for k in range(3)]
    inside, samples = [1.0, 0.5, float("nan")], [900.0, 100.0, 0.0]
    pooled, mean = rows(results(names, inside90=inside, held_out_samples=samples))[3:5]
    assert (pooled.ours, pooled.remark) == ("0.95", "reached")
    assert (mean.ours, mean.remark) == ("0.75", "missed")


def test_verdicts_rigs_and_sensors_are_judged() -> None:
    names = [f"pasco-oscillator/no-magnet-{k}" for k in range(4)]
    # a 90 % interval of one standard deviation on either side of 1.645
    means = [1.0, 1.0, 3.0, 3.0]
    low, high = ([mean + side * 1.6448536269514722 for mean in means] for side in (-1.0, 1.0))
    table = rows(
        results(
            names,
            verdict=["explained", "ambiguous", "unexplained", "adequate"],
            friction_after=means,
            friction_after_low=low,
            friction_after_high=high,
            noise_over_step=[0.9, 1.2, 2.0, float("nan")],
        )
    )
    reported = {row.what: row for row in table}
    clear = reported["records adequate, explained or ambiguous"]
    assert clear.ours.startswith("75 %: ")
    assert clear.remark == "missed"
    rig = reported["pasco-oscillator without the magnet: reduced chi-square of friction between 4 records"]
    assert (rig.ours, rig.remark) == ("1.3", "reached")
    sensor = reported["pasco-oscillator: noise of the sensor over its step over sqrt(12)"]
    assert sensor.ours == "0.9 to 2; 2 of 3 records with a step"
    assert sensor.remark == "missed"


def test_dry_friction_is_asked_of_the_springs() -> None:
    names = [f"spring-with-dampers/{part}" for part in ("free", "cardboard", "rubbing")]
    reported = {row.what: row for row in rows(results(names, dry_friction=[0.05, 0.3, 0.99]))}
    words = [reported[f"{name}: probability that dry friction matters"].remark for name in names]
    assert words == ["reached", "missed", "reached"]
