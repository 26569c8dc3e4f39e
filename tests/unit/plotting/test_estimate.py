"""Figures: they draw what they are given, with units, and leave matplotlib's state alone."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from scipy import stats

from decays import SYSTEM
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.plotting import (
    Interval,
    plot_amplitudes,
    plot_estimators,
    plot_fit,
    plot_friction,
    plot_friction_panels,
    plot_joint,
    save_figure,
)


@pytest.fixture
def decay(rng: np.random.Generator) -> FreeDecay:
    time = np.arange(400) / 100.0
    return FreeDecay(
        name="a record",
        values=0.02 * (1.0 - time / 5.0) * np.cos(10.0 * time) + rng.normal(0.0, 1e-4, time.size),
        start_time=1.0,
        step=0.01,
        quantity=QUANTITIES["displacement"],
        unit="m",
        system=SYSTEM,
        frequency=10.0,
        phase=0.0,
        rest_position=0.0,
        stops=False,
    )


def texts(figure: Figure) -> str:
    found = [text.get_text() for text in figure.findobj(mpl.text.Text)]
    return "\n".join(found)


def test_fit(decay: FreeDecay) -> None:
    prediction = 0.02 * (1.0 - decay.time / 5.0) * np.cos(10.0 * decay.time)
    figure = plot_fit(decay, prediction, noise_sd=1e-4)
    assert "displacement [m]" in texts(figure)
    whole, below = figure.axes[0], figure.axes[1]
    np.testing.assert_array_equal(whole.lines[-1].get_ydata(), prediction)
    np.testing.assert_allclose(below.lines[-1].get_ydata(), decay.values - prediction)
    assert below.get_ylabel() == "residual [m]"


def test_amplitudes_fall_by_two_coefficients_a_half_cycle(decay: FreeDecay) -> None:
    count = np.arange(12)
    amplitude = 0.02 - 1e-3 * count
    cycles = xr.Dataset(
        {
            "time": ("turning_point", count * np.pi / 10.0),
            "value": ("turning_point", 1e-3 + (-1.0) ** count * amplitude),
            "amplitude": ("turning_point", amplitude),
        },
        attrs={"rest_position": 1e-3},
    )
    figure = plot_amplitudes(decay, cycles, 5e-4, (-1e-2, 1e-2))
    (axes,) = figure.axes
    upper = axes.lines[1]
    np.testing.assert_allclose(upper.get_ydata()[[0, -1]], amplitude[[0, -1]])
    # however wide the band is, the turning points fill the axes, and nothing lies on it
    assert axes.get_ylim()[1] < 1.5 * amplitude[0]
    assert axes.get_legend() is None
    assert len(figure.legends) == 1


def test_estimators_tell_what_lies_outside() -> None:
    rows = [
        Interval(label="near", mean=0.0701, low=0.0699, high=0.0703, reference=(0.0701, 0.0699, 0.0703)),
        Interval(label="far", mean=14.3, low=11.0, high=18.0),
    ]
    said = texts(plot_estimators(rows, unit="N", truth=0.07))
    assert "14.3 →" in said
    assert "friction [N]" in said
    assert "true value" not in texts(plot_estimators(rows, unit="N"))


def test_friction_and_truth(rng: np.random.Generator) -> None:
    friction = stats.t(df=50, loc=0.07, scale=1e-3)
    draws = friction.rvs((4, 8, 100), random_state=rng)
    assert "true value" in texts(plot_friction(friction, unit="N", draws=draws, truth=0.071))
    assert "true value 0.2 →" in texts(plot_friction(friction, unit="N", truth=0.2))
    panels = plot_friction_panels(
        {"a": friction, "b": friction, "c": friction}, unit="N m", draws={"a": draws}
    )
    assert texts(panels).count("friction [N m]") == 3


def test_the_legend_of_friction_covers_no_hump() -> None:
    class Humps(stats.rv_continuous):
        def _pdf(self, x: np.ndarray) -> np.ndarray:
            return 0.5 * stats.norm.pdf(x, 0.2, 0.05) + 0.5 * stats.norm.pdf(x, 0.9, 0.01)

    figure = plot_friction(Humps(a=0.0, b=1.0)(), unit="N")
    figure.draw_without_rendering()
    (axes,) = figure.axes
    curve = axes.transData.transform(axes.lines[0].get_xydata())
    legend = axes.get_legend()
    assert legend is not None
    assert not legend.get_window_extent().contains(*curve[curve[:, 1].argmax()])


def test_joint() -> None:
    r, s = np.linspace(-3.0, 3.0, 50), np.linspace(0.1, 3.0, 40)
    friction, precision = stats.norm(), stats.gamma(4.0, scale=0.25)
    density = precision.pdf(s)[:, None] * friction.pdf(r)[None, :]
    figure = plot_joint(
        r,
        s,
        density,
        0.1 * density.max(),
        friction_unit="N",
        precision_unit="1/N2",
        friction=friction,
        precision=precision,
    )
    assert "90 % region" in texts(figure)
    assert "precision s [1/N2]" in texts(figure)


def test_saving_is_repeatable_and_leaves_no_trace(tmp_path: Path) -> None:
    before = dict(mpl.rcParams)
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        figure = plot_friction(stats.norm(1.0, 0.1), unit="N")
        assert save_figure(figure, tmp_path / folder, "f") == ["f.png", "f.pdf"]
    for name in ("f.png", "f.pdf"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert dict(mpl.rcParams) == before
