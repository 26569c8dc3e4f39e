"""What a result shows of itself in a notebook: figures by name, a table, and arrays of xarray."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.core.displays import figure_of, html_of
from friction_bayes.loop.report.result import LoopReport


@pytest.fixture(scope="module")
def estimate() -> fb.Estimate:
    return fb.estimate(short_decay(name="shelf <1>"), SYSTEM)


@pytest.mark.parametrize("what", ["overview", "fit", "residual", "amplitudes", "friction"])
def test_figures_by_name(estimate: fb.Estimate, what: str) -> None:
    assert estimate.plot(what).axes


@pytest.fixture(scope="module")
def wear() -> fb.MonitorReport:
    records = [short_decay(friction=friction, seed=k) for k, friction in enumerate((0.05, 0.06, 0.07))]
    return fb.monitor_records(records, SYSTEM, threshold=0.2)


@pytest.mark.parametrize("what", ["overview", "detection_points", "tracking", "remaining_life"])
def test_figures_of_monitoring_by_name(wear: fb.MonitorReport, what: str) -> None:
    assert wear.plot(what).axes
    with pytest.raises(fb.InputError, match=r"detection_points, overview, remaining_life or tracking"):
        wear.plot("fit")


def test_a_notebook_shows_what_monitoring_advises(wear: fb.MonitorReport) -> None:
    shown = wear._repr_html_()
    assert wear.advice()["text"] in shown
    assert f"{wear.to_dict()['health_assessment']['friction']['mean']:.5g} N" in shown


def test_a_figure_that_there_is_not_is_refused_with_those_that_there_are(estimate: fb.Estimate) -> None:
    with pytest.raises(
        fb.InputError, match=r"what: 'joint' is no figure .*amplitudes, fit, friction, overview or residual"
    ):
        figure_of(estimate, "joint")


def test_a_notebook_shows_the_lines_and_escapes_names(estimate: fb.Estimate, loop_report: LoopReport) -> None:
    shown = estimate._repr_html_()
    assert shown == html_of(estimate)
    assert f"{estimate.friction.mean():.5g} N" in shown
    assert "<1>" not in shown
    assert loop_report.verdict.upper() in loop_report._repr_html_()


def test_an_estimate_in_xarray_says_the_same(estimate: fb.Estimate) -> None:
    found, reported = estimate.to_xarray(), estimate.to_dict()
    low, high = reported["friction"]["interval90"]
    expected = [reported["friction"]["mean"], reported["friction"]["sd"], low, high]
    np.testing.assert_allclose(found["friction"], expected, rtol=1e-15)
    assert found["friction"].attrs["units"] == "N"
    np.testing.assert_allclose(found["fitted"] + found["residual"], found["signal"], atol=1e-15)
    assert found["time"][0] == estimate.decay.start_time
    tree = estimate.to_datatree()
    xr.testing.assert_identical(tree["summary"].to_dataset()["friction"], found["friction"])
    xr.testing.assert_identical(tree["records/0"].to_dataset()["residual"], found["residual"])


def test_the_residual_is_drawn_over_time_and_over_phase(estimate: fb.Estimate) -> None:
    time, phase, shape = estimate.plot(what="residual").axes
    left = estimate.decay.values - estimate.fit.prediction
    for axes in (time, phase):
        np.testing.assert_array_equal(axes.lines[0].get_ydata(), left)
    peak = np.argmax(estimate.decay.values)
    assert abs((phase.lines[0].get_xdata()[peak] + 180.0) % 360.0 - 180.0) < 5.0
    assert shape.get_xlabel() == "residual [m]"


def test_a_report_as_a_tree_has_draws_and_records(loop_report: LoopReport) -> None:
    tree = loop_report.to_datatree()
    np.testing.assert_array_equal(tree["mixture"]["friction"], loop_report.posterior["mixture"]["friction"])
    numbers, after = loop_report.to_xarray(), loop_report.friction_after
    xr.testing.assert_identical(tree["summary"].to_dataset(), numbers)
    np.testing.assert_array_equal(
        numbers["friction_after"], [after["mean"], after["sd"], *after["interval90"]]
    )
    for i, trace in enumerate(loop_report.traces):
        np.testing.assert_array_equal(tree[f"records/{i}/after"], trace.after)


@pytest.mark.parametrize("method", ["waveform", "envelope", "normal-gamma", "gamma-exponential"])
def test_an_estimate_survives_pickle_and_copy(method: str) -> None:
    found = fb.estimate(short_decay(), SYSTEM, method=method)
    for again in (pickle.loads(pickle.dumps(found)), copy.deepcopy(found)):
        assert again.to_dict() == found.to_dict()
        centre = again.fit.target.centre[None]
        np.testing.assert_array_equal(again.fit.target.log_prob(centre), found.fit.target.log_prob(centre))


def test_a_report_survives_pickle(loop_report: LoopReport) -> None:
    assert pickle.loads(pickle.dumps(loop_report)).to_dict() == loop_report.to_dict()
