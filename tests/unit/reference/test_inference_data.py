"""ArviZ itself on what a sampler leaves: trees with 1.x, its own class with 0.2x."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from scipy import stats

import friction_bayes as fb
from friction_bayes.conjugate.targets import normal_gamma_target
from friction_bayes.reference import load_tree, sample_target, save_tree
from friction_bayes.reference.inference_data import load_arviz

# none of them far out, of which cross-validation would warn
SAMPLES = stats.norm(0.07, 0.17).ppf(np.linspace(0.02, 0.98, 40))

# ArviZ 0.2x is older than what matplotlib 3.11 and pandas 3.1 deprecate
pytestmark = [
    pytest.mark.filterwarnings("ignore::matplotlib.MatplotlibDeprecationWarning"),
    pytest.mark.filterwarnings("ignore:The inplace keyword:DeprecationWarning"),
]


@pytest.fixture(scope="module")
def arviz() -> Any:
    """Of the extra ``arviz``, which the other tests do without."""
    if find_spec("arviz") is None:
        pytest.skip("the extra arviz is not installed")
    return load_arviz("testing")


def sampled(mean: float) -> xr.DataTree:
    prior = fb.NormalGamma(mu=mean, lam=10.0, alpha=1.0, beta=0.02)
    return sample_target(normal_gamma_target(prior, SAMPLES), seed=11, walkers=8)


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> xr.DataTree:
    """From its file."""
    path = tmp_path_factory.mktemp("reference") / "reference.nc"
    save_tree(sampled(0.1), path)
    return load_tree(path)


@pytest.fixture
def readable(arviz: Any, tree: xr.DataTree) -> Iterator[Any]:
    yield fb.to_inference_data(tree)
    plt.close("all")


def test_is_the_tree_itself_where_arviz_reads_trees(arviz: Any, tree: xr.DataTree, readable: Any) -> None:
    if sys.version_info >= (3, 12):
        assert readable is tree
    else:
        assert isinstance(readable, arviz.InferenceData)
        assert set(readable.groups()) == set(tree.children)
        assert readable.attrs["nested_rhat"] == tree.attrs["nested_rhat"]


def test_summary_agrees(arviz: Any, tree: xr.DataTree, readable: Any) -> None:
    table = arviz.summary(readable, round_to="none")
    own = tree["posterior"]["friction"]
    assert float(table.loc["friction", "mean"]) == pytest.approx(float(own.mean()))
    assert float(table.loc["friction", "r_hat"]) == pytest.approx(own.attrs["nested_rhat"], abs=2e-3)
    assert float(table.loc["friction", "r_hat"]) < 1.01
    assert float(table.loc["friction", "ess_bulk"]) == pytest.approx(own.attrs["ess_bulk"], rel=0.35)
    assert float(table.loc["friction", "mcse_mean"]) == pytest.approx(own.attrs["mcse_mean"], rel=0.3)


@pytest.mark.parametrize("plot", ["plot_trace", "plot_rank"])
def test_plots(arviz: Any, readable: Any, plot: str) -> None:
    before = plt.get_fignums()
    getattr(arviz, plot)(readable, var_names=["friction"])
    assert len(plt.get_fignums()) == len(before) + 1


def test_cross_validation_and_comparison(arviz: Any, readable: Any) -> None:
    near = arviz.loo(readable, pointwise=True, reff=1.0)
    far = arviz.loo(fb.to_inference_data(sampled(1.0)), pointwise=True, reff=1.0)
    assert float(near.pareto_k.max()) < 0.7
    table = arviz.compare({"near": near, "far": far})
    assert list(table.index) == ["near", "far"]
    assert list(arviz.compare({"one": readable, "far": far}).index) == ["one", "far"]


def test_draws_of_a_closed_loop(arviz: Any) -> None:
    """Independent ones in one chain, which has no ranks among others; a sampler's lie below them."""
    draws = np.random.default_rng(1).standard_normal((1, 400))
    numbers = {"chain": np.arange(1), "draw": np.arange(400)}
    posterior = xr.Dataset({"friction": (("chain", "draw"), draws)}, coords=numbers)
    tree = xr.DataTree.from_dict(
        {"posterior": posterior, "mixture": posterior, "reference/posterior": posterior}
    )
    readable = fb.to_inference_data(tree)
    for group in ("posterior", "mixture"):
        table = arviz.summary(readable, group=group, round_to="none")
        assert float(table.loc["friction", "mean"]) == pytest.approx(draws.mean())
    arviz.plot_trace(readable)
    plt.close("all")
    nested = arviz.summary(fb.to_inference_data(tree["reference"]), round_to="none")
    assert float(nested.loc["friction", "sd"]) == pytest.approx(draws.std(ddof=1), rel=0.01)


def test_says_which_extra_is_missing(monkeypatch: pytest.MonkeyPatch, tree: xr.DataTree) -> None:
    monkeypatch.setitem(sys.modules, "arviz", None)
    with pytest.raises(fb.InputError, match=r"package arviz, which is .* \"\.\[arviz\]\" in the checkout"):
        fb.to_inference_data(tree)
