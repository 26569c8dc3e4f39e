"""Rank and ESS plots of a sampler's draws, by ArviZ of either generation."""

from __future__ import annotations

import sys
from importlib.util import find_spec

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

from friction_bayes.cli.sampled import figures_of_draws
from friction_bayes.plotting import figure_files
from friction_bayes.plotting.draws import draws_figures


@pytest.fixture
def tree(rng: np.random.Generator) -> xr.DataTree:
    values = {"friction": rng.standard_normal((4, 3000)), "precision": rng.gamma(3.0, size=(4, 3000))}
    posterior = xr.Dataset({name: (("chain", "draw"), each) for name, each in values.items()})
    posterior["covariance"] = (("chain", "draw", "one", "other"), rng.standard_normal((4, 3000, 2, 2)))
    return xr.DataTree.from_dict({"posterior": posterior})


@pytest.mark.skipif(find_spec("arviz") is None, reason="the extra arviz is not installed")
def test_one_panel_a_scalar_parameter(tree: xr.DataTree) -> None:
    before = plt.get_fignums()
    figures = draws_figures(tree)
    assert set(figures) == {"ranks", "ess"}
    assert plt.get_fignums() == before
    for figure in figures.values():
        assert [axes.get_title(loc="left") or axes.get_title() for axes in figure.axes] == [
            "friction",
            "precision",
        ]
    again = draws_figures(tree)
    for name, figure in figures.items():
        assert figure_files(figure, ("svg",)) == figure_files(again[name], ("svg",))


def test_without_arviz_says_in_a_line_what_would_draw(
    tree: xr.DataTree, monkeypatch: pytest.MonkeyPatch
) -> None:
    reported: list[str] = []
    monkeypatch.setattr("friction_bayes.cli.sampled.note", reported.append)
    monkeypatch.setitem(sys.modules, "arviz", None)
    assert figures_of_draws(tree) == {}
    (line,) = reported
    assert 'pip install ".[arviz]"' in line
    assert "\n" not in line
