"""Comparison of methods and monitoring experiment on tiny configurations, and figures of their results."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from experiments import method_comparison, monitoring, wear_laws
from experiments.method_comparison import LABELS
from experiments.method_tables import share_error, size_of_error, with_error
from experiments.runner import main
from friction_bayes.plotting.style import styled
from paper_figures import method_panels, methods_effect, methods_noise, methods_time
from paper_figures import monitoring as monitoring_figure

TINY = {
    "records": 2,
    "checked": 0,
    "duration": 8.0,
    "noise_levels": (1e-4,),
    "rates": (),
    "lengths": (),
    "effects": {"none": {}, "sensor offset": {"sensor_offset.offset": 1e-3}},
}


def run(module: Any, folder: Path, **settings: Any) -> xr.Dataset:
    experiment = replace(module.EXPERIMENT, config=replace(module.EXPERIMENT.config, **settings))
    return main(experiment, ["--workers", "1", "--results", str(folder)])


def test_methods_on_the_same_records(tmp_path: Path) -> None:
    found = run(method_comparison, tmp_path, **TINY)
    assert found["method"].values.tolist() == list(LABELS)
    assert found["question"].values.tolist() == [*("noise", "effect", "effect")]
    reported = found.drop_sel(method=["emcee", "gamma-exponential"])
    assert np.isfinite(reported["error"]).all()
    assert np.isnan(found["error"].sel({"method": "emcee"})).all()
    quiet = found["rms_error"].sel(condition="noise: 0.1 mm")
    # the whole signal of 8 s at 0.1 mm: Cramer-Rao bound 0.2 %; the line and the decrement are biased
    assert float(quiet.sel({"method": "waveform"})) < 0.01
    same = found["friction"].sel(condition="noise: 0.1 mm")
    ours, theirs = (same.sel({"method": name}).values for name in ("waveform", "least squares (lmfit)"))
    np.testing.assert_allclose(ours, theirs, rtol=1e-4)
    page = (tmp_path / "method_comparison.md").read_text()
    assert "| noise: 0.1 mm |" in page
    assert "median time, ms" in page
    with styled():
        for figure in (methods_noise.FIGURE, methods_effect.FIGURE, methods_time.FIGURE):
            figure.draw({"method_comparison": found}).draw_without_rendering()
    assert set(method_panels.PANELS) <= set(found.data_vars)


def test_machines_are_followed_to_their_end(tmp_path: Path) -> None:
    laws = ("both", "accelerating", "jump", "constant")
    found = run(monitoring, tmp_path, records=1, points=(4,), laws=laws)
    assert found["law"].values.tolist() == list(laws)
    assert set(laws) < set(monitoring.LAWS)
    pit = found["life_pit"].values
    assert np.all((pit >= 0.0) & (pit <= 1.0))
    wearing = found.sel(law=["both", "accelerating"])
    assert np.isfinite(wearing["true_life"]).all()
    assert np.isinf(found["true_life"].sel(law=["jump", "constant"])).all()
    # friction has grown by about a half; the mean of all records has seen half of that
    assert (wearing["plain_error"] < -0.05).all()
    assert (abs(wearing["forgetting_error"]) < 0.1).all()
    with styled():
        monitoring_figure.FIGURE.draw({"monitoring": found}).draw_without_rendering()


def test_monte_carlo_errors() -> None:
    root, spread = size_of_error(xr.DataArray([3.0, -4.0, np.nan]))
    assert root == pytest.approx(12.5**0.5)
    # squares 9 and 16: their mean is off by 3.5, half of that over the root for the root
    assert spread == pytest.approx(3.5 / (2.0 * 12.5**0.5))
    share, spread = share_error(xr.DataArray([1.0, 1.0, 0.0, 1.0]))
    assert (share, spread) == pytest.approx((0.75, (0.75 * 0.25 / 4.0) ** 0.5))
    assert share_error(xr.DataArray(np.ones(10)))[1] > 0.0
    assert with_error(0.2234, 0.0171) == "0.22 ± 0.02"
    assert with_error(88.0, 5.2) == "88 ± 5"
    assert with_error(float("nan"), 1.0) == "–"


@pytest.mark.parametrize("law", wear_laws.LAWS)
def test_a_law_of_wear_reaches_its_threshold_where_it_says(law: str, rng: np.random.Generator) -> None:
    times = np.linspace(0.0, 1.0, 50)
    # the same machine each time, whatever the times at which it is looked at
    before, after = deepcopy(rng), deepcopy(rng)
    path = wear_laws.LAWS[law](times, 0.6, rng)
    assert np.all(np.diff(path.worn) >= 0.0)
    assert path.worn[0] == pytest.approx(0.0)
    assert path.left > 0.0
    assert path.life > 0.0
    assert np.isinf(path.life) == (law in {"saturating, stops short", "one jump", "none"})
    if np.isfinite(path.life):
        end, step, threshold = 1.0 + path.life, 1.0 / 640.0, path.worn[-1] + path.left
        early = wear_laws.LAWS[law](np.append(times, end - 2.0 * step), 0.6, before).worn[-1]
        assert early < threshold
        assert wear_laws.LAWS[law](np.append(times, end), 0.6, after).worn[-1] > threshold * (1.0 - 1e-9)


def test_laws_of_wear_get_a_remaining_life(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    some = {name: wear_laws.LAWS[name] for name in ("quadratic", "kink", "shocks", "none")}
    monkeypatch.setattr(wear_laws, "LAWS", some)
    found = run(wear_laws, tmp_path, records=1, points=(4,))
    assert found["law"].values.tolist() == list(some)
    assert (found["averaged_low"] <= found["averaged_high"]).all()
    assert "covers" in (tmp_path / "wear_laws.md").read_text()
