"""Figures of a closed loop: they draw what the report holds, with units, for one record or several."""

from __future__ import annotations

from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from friction_bayes.loop.report.result import LoopReport
from friction_bayes.plotting.loop import (
    loop_figures,
    plot_candidates,
    plot_fluctuation,
    plot_forecast,
    plot_loop,
    plot_loop_friction,
    plot_loop_residual,
    plot_loop_signal,
    plot_turning_points,
)
from friction_bayes.plotting.motion_units import motion_unit


def texts(figure: Figure) -> str:
    return "\n".join(text.get_text() for text in figure.findobj(mpl.text.Text))


def test_candidates_are_bars_of_their_probability(loop_report: LoopReport) -> None:
    figure = plot_candidates(loop_report)
    widths = [bar.get_width() for bar in figure.axes[0].patches]
    assert widths == [0.7, 0.29, 0.01, 0.0]
    said = texts(figure)
    for word in ("viscous damping + quadratic drag", "Coulomb friction alone", "70.0 %", "< 0.1 %"):
        assert word in said


def test_candidates_that_explain_nothing_are_drawn_without_a_probability(loop_report: LoopReport) -> None:
    report = replace(loop_report, verdict="unexplained")
    for figure in (plot_candidates(report), plot_loop(report)):
        said = texts(figure)
        assert "%" not in said.replace("90 % intervals", "")
        assert "posterior probability" not in said
        assert "none of them is an explanation" in said
    assert "what comes closest: unexplained" in said


def test_many_candidates_are_gathered(loop_report: LoopReport) -> None:
    many = [{"effects": [f"effect_{i}"], "probability": 1.0 / 20.0} for i in range(20)]
    axes = plot_candidates(replace(loop_report, candidates=many)).axes[0]
    assert len(axes.patches) == 9
    assert axes.patches[-1].get_width() == pytest.approx(12.0 / 20.0)
    assert "12 others together" in texts(axes.figure)


def test_friction_of_each_candidate_that_counts(loop_report: LoopReport) -> None:
    figure = plot_loop_friction(loop_report)
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert labels == [
        "paper's procedure",
        "before: Coulomb alone",
        "viscous damping",
        "friction drift",
        "after",
    ]
    assert "dotted: reference 0.5 N" in texts(figure)
    intervals = [line.get_xdata() for line in figure.axes[0].lines if len(line.get_xdata()) == 2]
    np.testing.assert_allclose(intervals[-2], loop_report.friction_after["interval90"])


def test_no_paper_procedure_and_one_candidate(loop_report: LoopReport) -> None:
    procedure = {"friction": None, "disagrees": True, "because": [], "why": "too few"}
    mixture = loop_report.posterior["mixture"].dataset
    alone = mixture.assign(candidate=0 * mixture["candidate"])
    tree = loop_report.posterior.copy()
    tree["mixture"] = alone
    report = replace(loop_report, paper_procedure=procedure, reference_check=None, posterior=tree)
    labels = [label.get_text() for label in plot_loop_friction(report).axes[0].get_yticklabels()]
    assert labels == ["before: Coulomb alone", "after"]


def test_signal_shows_both_models(loop_report: LoopReport) -> None:
    record = loop_report.traces[0]
    axes = plot_loop_signal(record).axes[0]
    drawn = [np.asarray(line.get_ydata()) for line in axes.lines[:3]]
    for ours, theirs in zip(drawn, (record.signal, record.before, record.after), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert axes.get_ylabel() == "displacement [m]"


def test_residual_panels(loop_report: LoopReport) -> None:
    record = loop_report.traces[0]
    panels = plot_loop_residual(record).axes
    assert len(panels) == 6
    for axes in panels[4:]:
        low, high = axes.get_xlim()
        assert sum(low <= tick <= high for tick in axes.get_xticks()) <= 7
    np.testing.assert_allclose(panels[0].lines[0].get_ydata(), record.signal - record.before)
    np.testing.assert_allclose(panels[1].lines[0].get_ydata(), record.signal - record.after)
    angle = np.asarray(panels[3].lines[0].get_xdata())
    # the positive turning points, multiples of 2 pi / 10 s, are at 0 degrees
    inside = record.time <= record.turning_times[-1]
    turns = record.time[inside] * 10.0 / (2.0 * np.pi)
    np.testing.assert_allclose(angle, 360.0 * np.mod(turns, 1.0), atol=1e-6)


def test_phase_starts_at_the_positive_turning_point(loop_report: LoopReport) -> None:
    record = loop_report.traces[0]
    turned = replace(
        record, signal=-record.signal, after=-record.after, turning_points=-record.turning_points
    )
    one, other = (np.asarray(plot_loop_residual(r).axes[3].lines[0].get_xdata()) for r in (record, turned))
    np.testing.assert_allclose(np.mod(one - other, 360.0), 180.0)


def test_clipped_samples_have_no_residual(loop_report: LoopReport) -> None:
    record = loop_report.traces[0]
    sides = np.where(np.arange(record.time.size) % 10 == 0, 1.0, 0.0)
    panels = plot_loop_residual(replace(record, sides=sides)).axes
    assert len(panels[0].lines[0].get_xdata()) == np.count_nonzero(sides == 0.0)


@pytest.mark.parametrize(
    ("quantity", "unit", "shown"),
    [
        ("displacement", "m", "[m]"),
        ("angular_velocity", "rad/s", "[rad]"),
        ("angular_velocity", "V", "[V s]"),
        ("acceleration", "V", "[V s2]"),
    ],
)
def test_amplitude_is_a_displacement(quantity: str, unit: str, shown: str, loop_report: LoopReport) -> None:
    record = replace(loop_report.traces[0], quantity=quantity, unit=unit)
    assert plot_turning_points(record).axes[0].get_ylabel() == f"amplitude {shown}"


@pytest.mark.parametrize(
    ("quantity", "unit", "order", "shown"),
    [
        ("displacement", "px", 1, "px/s"),
        ("angular_velocity", "V", 1, "V"),
        ("displacement", "counts", 0, "counts"),
        ("acceleration", "m/s2", 1, "m/s"),
        ("acceleration", "V", 1, "V s"),
        ("angle", "rad", 2, "rad/s2"),
    ],
)
def test_units_of_the_motion(quantity: str, unit: str, order: int, shown: str) -> None:
    assert motion_unit(quantity, unit, order) == shown


def test_labels_of_three_lines_are_smaller(loop_report: LoopReport) -> None:
    long = ["quadratic_drag", "cubic_stiffness", "random_force", "sensor_nonlinearity", "sensor_drift"]
    candidates = [
        {"effects": [*long, "timing_jitter"], "probability": 0.6},
        {"effects": [], "probability": 0.4},
    ]
    sizes = [
        plot_candidates(replace(loop_report, candidates=some)).axes[0].get_yticklabels()[0].get_fontsize()
        for some in (candidates, candidates[1:])
    ]
    assert sizes[0] < sizes[1]


def test_measured_turning_points(loop_report: LoopReport) -> None:
    record = replace(loop_report.traces[0], signal=1.1 * loop_report.traces[0].after)
    left, right = plot_turning_points(record).axes
    measured = np.asarray(left.lines[0].get_ydata())
    np.testing.assert_allclose(measured, 1.1 * np.abs(record.turning_points)[: measured.size])
    assert "lost in a half cycle [m]" in right.get_ylabel()
    # a straight line takes the same from every half cycle
    before = np.asarray(right.lines[1].get_ydata())
    np.testing.assert_allclose(before, before[0])


def test_record_that_never_turns(loop_report: LoopReport) -> None:
    nothing = np.empty(0)
    record = replace(
        loop_report.traces[0],
        turning_times=nothing,
        turning_points=nothing,
        turning_times_before=nothing,
        turning_points_before=nothing,
        phase=np.zeros(600),
    )
    for draw in (plot_loop_signal, plot_loop_residual, plot_turning_points):
        assert draw(record).axes


def test_measured_force(loop_report: LoopReport) -> None:
    record = loop_report.traces[0]
    sliding = -0.5 * np.sign(np.sin(10.0 * record.time))
    forces = (1.1 * sliding, 0.9 * sliding, sliding)
    figures = loop_figures(replace(loop_report, traces=(replace(record, forces=forces, fluctuation=None),)))
    left, right = figures["force"].axes
    assert left.get_ylabel() == "resisting force [N]"
    level = np.asarray(right.lines[0].get_ydata())
    np.testing.assert_allclose(level[sliding != 0.0], 0.55)


def test_all_figures_by_name(loop_report: LoopReport) -> None:
    record = loop_report.traces[0]
    one = {"candidates", "friction", "signal", "residual", "turning_points", "forecast", "fluctuation"}
    assert set(loop_figures(loop_report)) == one
    several = replace(loop_report, traces=(record, replace(record, name="another")))
    two = loop_figures(several)
    assert {"signal_1", "residual_2", "turning_points_2"} <= set(two)
    assert "another" in texts(two["signal_2"])
    assert f"{record.name}, first of 2 records" in texts(plot_loop(several))
    assert "records" not in texts(plot_loop(loop_report))


def test_the_held_out_part_is_drawn_with_its_band(loop_report: LoopReport) -> None:
    record = loop_report.traces[0]
    assert record.forecasts is not None
    before, ahead = record.forecasts
    upper, lower = plot_forecast(record).axes
    drawn = [np.asarray(line.get_ydata()) for line in upper.lines]
    for ours, theirs in zip(drawn, (ahead.signal, before.mean, ahead.mean), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    corners = lower.collections[0].get_paths()[0].vertices
    assert np.max(corners[:, 1]) == pytest.approx(1.645 * ahead.sd[0])
    np.testing.assert_array_equal(lower.lines[1].get_ydata(), ahead.signal - ahead.mean)
    without = replace(loop_report, traces=(replace(record, forecasts=None),))
    assert "forecast" not in loop_figures(without)


def test_the_force_left_is_drawn_against_all_it_may_depend_on(loop_report: LoopReport) -> None:
    figure = plot_fluctuation(loop_report.traces[0])
    labels = [axes.get_xlabel() for axes in figure.axes]
    assert labels == ["time [s]", "velocity [m/s]", "position [m]", "amplitude [m]"]
    assert "force left [N]" in texts(figure)
    assert "depends on" not in texts(figure)
    marked = plot_fluctuation(loop_report.traces[0], "position").axes[2]
    assert marked.get_xlabel() == "position [m]"
    assert marked.get_title(loc="right") == "depends on the position"


def test_report_plots_itself_and_leaves_the_style(loop_report: LoopReport) -> None:
    before = dict(mpl.rcParams)
    said = texts(loop_report.plot())
    assert "residual before: RMS" in said
    assert texts(plot_loop(loop_report)) == said
    assert dict(mpl.rcParams) == before
