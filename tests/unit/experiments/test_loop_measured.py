"""The experiments on measured records: laws carried to other segments, and the table's arithmetic."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from experiments.loop_measured import NUMBERS, SERIES, TEXTS, assemble, rows
from experiments.pendulum_forecast import PUBLISHED_COEFFICIENT, Law, forecast, identified, published
from friction_bayes.loop.result import LoopReport

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


def test_what_cannot_be_forecast_is_no_gain() -> None:
    results = []
    for after in (0.1, 0.2, float("nan")):
        numbers = dict.fromkeys(NUMBERS, 1.0) | {"held_out_before": 1.0, "held_out_after": after}
        texts = dict.fromkeys(TEXTS, "") | {"candidates": '[{"effects": [], "probability": 1.0}]'}
        results.append(numbers | texts | {name: [0.0, 1.0] for name in SERIES})
    cells = [{"record": f"bicycle-wheel/{k}"} for k in range(3)]
    table = rows(assemble(cells, results))
    assert table[0].ours == "0.2"
    assert "reached" in table[0].remark
    assert len(table) == 4
