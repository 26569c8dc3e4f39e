"""What an estimate shows of itself: in one line, as a table, as a figure; and what is no record."""

from __future__ import annotations

import math

import matplotlib as mpl
import numpy as np
import pytest

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.core.errors import InputError
from friction_bayes.core.summary import TAILS


@pytest.fixture
def estimate() -> fb.Estimate:
    return fb.estimate(short_decay(name="shelf.csv"), SYSTEM, method="normal-gamma")


def test_one_line(estimate: fb.Estimate) -> None:
    low, high = estimate.friction.ppf(TAILS)
    assert repr(estimate) == (
        f"Estimate(shelf.csv, normal-gamma: friction {estimate.friction.mean():.4g} N, "
        f"90 %: {low:.4g} .. {high:.4g})"
    )


def test_summary_is_a_table_of_quantities(estimate: fb.Estimate) -> None:
    table = estimate.summary()
    assert list(table.columns) == ["mean", "sd", "eti90_lb", "eti90_ub", "unit"]
    quantities = [
        "friction",
        "friction_over_stiffness",
        "precision",
        "frequency",
        "noise_sd",
        "rest_position",
    ]
    assert list(table.index) == quantities
    row = table.loc["friction"]
    assert row["mean"] == pytest.approx(estimate.friction.mean())
    assert (row["eti90_lb"], row["eti90_ub"]) == pytest.approx(tuple(estimate.friction.ppf(TAILS)))
    assert list(table["unit"]) == ["N", "m", "1/N^2", "rad/s", "m", "m"]
    # the paper's methods know no noise of a sample
    assert math.isnan(table.loc["noise_sd", "mean"])


def test_plot_shows_record_and_friction(estimate: fb.Estimate) -> None:
    figure = estimate.plot()
    said = "\n".join(text.get_text() for text in figure.findobj(mpl.text.Text))
    for word in ("shelf.csv, normal-gamma", "displacement [m]", "friction [N]", "90 % interval"):
        assert word in said
    record = figure.axes[0].lines[0]
    np.testing.assert_array_equal(record.get_ydata(), estimate.decay.values)


def test_an_array_is_no_record() -> None:
    with pytest.raises(InputError, match=r"ndarray instead of a record.*make_record"):
        fb.estimate(np.zeros(100), SYSTEM)
    with pytest.raises(InputError, match=r"instead of a record or a list of records"):
        fb.close_loop(np.zeros(100), SYSTEM, seed=1)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="list instead of a record"):
        fb.close_loop([[1.0, 2.0]], SYSTEM, seed=1)
