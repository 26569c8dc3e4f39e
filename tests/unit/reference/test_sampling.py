"""The sampler: repeatable, self-critical, and readable by ArviZ."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import version

import numpy as np
import pytest
import xarray as xr
from arviz_stats import ess, loo, rhat, summary
from arviz_stats.base import array_stats
from scipy.special import logsumexp

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.conjugate.likelihood import Target
from friction_bayes.conjugate.targets import normal_gamma_target
from friction_bayes.reference import load_tree, sample_reference, sample_target, save_tree
from friction_bayes.reference.convergence import diagnose
from friction_bayes.reference.ensembles import OVERDISPERSION, Ensembles
from friction_bayes.reference.tree import by_walker

PRIOR = fb.NormalGamma(mu=0.1, lam=0.01, alpha=1.0, beta=0.02)
SAMPLES = np.random.default_rng(3).normal(0.07, 0.17, 40)


@pytest.fixture(scope="module")
def target() -> Target:
    return normal_gamma_target(PRIOR, SAMPLES)


@pytest.fixture(scope="module")
def tree(target: Target) -> xr.DataTree:
    return sample_target(target, seed=11)


def test_converges_and_says_so(tree: xr.DataTree) -> None:
    attrs = tree.attrs
    assert attrs["converged"] == 1
    assert attrs["nested_rhat"] < 1.01
    assert min(attrs["ess_bulk"], attrs["ess_tail"]) > 1000.0
    assert attrs["steps"] - attrs["burn_in"] > 50 * attrs["tau"]
    assert 0.2 < attrs["acceptance_fraction"] < 0.9
    assert attrs["seed"] == 11
    assert attrs["wall_time_s"] > 0.0
    assert attrs["emcee_version"] == version("emcee")
    own = tree["posterior"]["friction"].attrs
    assert set(own) == {"nested_rhat", "ess_bulk", "ess_tail", "tau", "mcse_mean"}
    spread = float(tree["posterior"]["friction"].std())
    assert own["mcse_mean"] == pytest.approx(spread / np.sqrt(own["ess_bulk"]), rel=0.3)


def test_same_seed_same_bits(target: Target, tree: xr.DataTree) -> None:
    again, other = sample_target(target, seed=11), sample_target(target, seed=12)
    for group in tree.children:
        xr.testing.assert_identical(again[group].to_dataset(), tree[group].to_dataset())
    assert {k: v for k, v in again.attrs.items() if k != "wall_time_s"} == {
        k: v for k, v in tree.attrs.items() if k != "wall_time_s"
    }
    assert not np.array_equal(other["posterior"]["friction"][:, 0], tree["posterior"]["friction"][:, 0])


def test_one_seed_is_not_one_walk_for_all_records(tree: xr.DataTree) -> None:
    """In standardised coordinates the posterior of other data of the same size has the same shape."""
    other = sample_target(normal_gamma_target(PRIOR, SAMPLES + 1e-9), seed=11)
    assert not np.allclose(
        other["posterior"]["friction"][:, 0], tree["posterior"]["friction"][:, 0], rtol=1e-3
    )


def test_global_random_state_is_left_alone(target: Target) -> None:
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    Ensembles(target, seed=1, ensembles=4, walkers=8).advance(5)
    assert np.array_equal(np.random.get_state()[1], before)  # noqa: NPY002


def test_groups_hold_what_they_should(target: Target, tree: xr.DataTree) -> None:
    assert set(tree.children) == {
        "posterior",
        "sample_stats",
        "observed_data",
        "log_likelihood",
        "posterior_predictive",
        "prior",
    }
    posterior = tree["posterior"].to_dataset()
    assert set(posterior.data_vars) == {"friction", "precision"}
    assert posterior.sizes["chain"] == 4
    steps = posterior.sizes["draw"] // 32
    assert posterior["walker"].values.tolist() == np.repeat(np.arange(32), steps).tolist()
    assert by_walker(posterior["friction"]).shape == (4, 32, steps)
    np.testing.assert_array_equal(
        by_walker(posterior["friction"])[1, 2], posterior["friction"][1, posterior["walker"].values == 2]
    )
    theta = np.column_stack(
        [posterior["friction"].values.ravel(), np.log(posterior["precision"].values.ravel())]
    )
    np.testing.assert_allclose(target.log_prob(theta), tree["sample_stats"]["lp"].values.ravel(), rtol=1e-9)
    np.testing.assert_array_equal(tree["observed_data"]["friction_sample"], SAMPLES)
    pointwise = tree["log_likelihood"]["friction_sample"]
    assert pointwise.sizes["chain"] * pointwise.sizes["draw"] <= 500
    # under their own numbers: the thinned draws are draws of the posterior
    same = posterior.sel(chain=pointwise["chain"], draw=pointwise["draw"])
    friction, precision = same["friction"].values, same["precision"].values
    by_hand = -0.5 * precision * (SAMPLES[5] - friction) ** 2 + 0.5 * np.log(precision / (2.0 * np.pi))
    np.testing.assert_allclose(pointwise[..., 5], by_hand, rtol=1e-9)
    predicted = tree["posterior_predictive"]["friction_sample"]
    assert float(predicted.std()) == pytest.approx(SAMPLES.std(), rel=0.2)


def test_arviz_reads_it(tree: xr.DataTree) -> None:
    table = summary(tree, var_names=["friction"])
    assert float(table.loc["friction", "mean"]) == pytest.approx(
        float(tree["posterior"]["friction"].mean()), rel=0.05
    )
    assert float(ess(tree)["friction"]) > 1000.0
    assert np.isfinite(loo(tree, reff=1.0).elpd)


def test_arviz_finds_what_we_find(tree: xr.DataTree) -> None:
    """An ensemble is a chain; walkers for chains would have an R-hat of some 1.01."""
    theirs = {"rhat": rhat(tree), "ess": ess(tree)}
    for name, draws in tree["posterior"].data_vars.items():
        assert float(theirs["rhat"][name]) == pytest.approx(draws.attrs["nested_rhat"], abs=1e-3)
        assert float(theirs["ess"][name]) == pytest.approx(draws.attrs["ess_bulk"], rel=0.35)
        assert array_stats.rhat(by_walker(draws).reshape(128, -1)) > 1.007


def test_an_ensemble_apart_is_seen_by_arviz_too(tree: xr.DataTree) -> None:
    friction = tree["posterior"]["friction"].copy(deep=True)
    friction[2] += 0.5 * friction.std()
    assert float(rhat(friction.to_dataset())["friction"]) > 1.02
    assert diagnose(by_walker(friction).reshape(128, -1), 4, 1).nested_rhat > 1.02


def test_file_reads_back_equal(tree: xr.DataTree, tmp_path) -> None:
    path = tmp_path / "reference.nc"
    save_tree(tree, path)
    save_tree(tree, path)
    assert [p.name for p in tmp_path.iterdir()] == ["reference.nc"]
    back = load_tree(path)
    xr.testing.assert_identical(back, tree)
    with pytest.raises(fb.InputError, match="no such file"):
        load_tree(tmp_path / "missing.nc")


def test_failed_write_leaves_nothing(tree: xr.DataTree, tmp_path) -> None:
    bad = tree.copy()
    bad.attrs["unwritable"] = object()
    with pytest.raises(TypeError, match="no native HDF5 equivalent"):
        save_tree(bad, tmp_path / "reference.nc")
    assert list(tmp_path.iterdir()) == []


def test_says_when_it_has_not_converged(target: Target) -> None:
    with pytest.warns(fb.NotConvergedWarning, match=r"used up its 150 steps: nested R-hat .*\(above 50\)"):
        short = sample_target(target, seed=1, max_steps=150)
    assert short.attrs["converged"] == 0


def test_modes_that_never_meet_are_not_converged() -> None:
    """Two far modes: no walker crosses, every ensemble keeps the split it started with."""

    def log_prob(theta: np.ndarray) -> np.ndarray:
        return np.logaddexp(-0.5 * (theta[:, 0] - 300.0) ** 2, -0.5 * (theta[:, 0] + 300.0) ** 2)

    base = normal_gamma_target(PRIOR, SAMPLES)
    target = replace(
        base,
        names=("friction",),
        log_prob=log_prob,
        centre=np.zeros(1),
        covariance=np.array([[300.0**2]]),
        posterior=lambda theta: {"friction": theta[:, 0]},
        pointwise=lambda theta: theta,
        predictive=lambda theta, rng: theta,
        prior_draws=lambda rng, n: rng.standard_normal((n, 1)),
    )
    with pytest.warns(fb.NotConvergedWarning, match="nested R-hat"):
        tree = sample_target(target, seed=2, max_steps=300)
    assert tree.attrs["converged"] == 0
    # by an autocorrelation time of the whole run it would be thinned to a draw or none
    assert tree.attrs["thinning"] == 1


def test_one_ensemble_apart_is_seen(rng: np.random.Generator) -> None:
    draws = rng.standard_normal((32, 200))
    assert diagnose(draws, 4, 1).nested_rhat < 1.01
    draws[:8] += 0.5
    assert diagnose(draws, 4, 1).nested_rhat > 1.02


def test_starts_wide_and_where_the_probability_is_not_zero(target: Target) -> None:
    run = Ensembles(target, seed=5, ensembles=4, walkers=200)
    starts = np.concatenate([state.coords for state in run._states])
    assert starts.std() == pytest.approx(OVERDISPERSION, rel=0.1)
    half = replace(
        target, log_prob=lambda t: np.where(t[:, 0] > target.centre[0], target.log_prob(t), -np.inf)
    )
    with pytest.raises(fb.InputError, match="not finite at its centre"):
        Ensembles(half, seed=5, ensembles=4, walkers=32)
    inside = replace(target, log_prob=lambda t: np.where(t[:, 0] > 0.0, target.log_prob(t), -np.inf))
    positive = sample_target(inside, seed=5)["posterior"]["friction"]
    assert float(positive.min()) > 0.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"ensembles": 3}, "ensembles: 3 cannot show convergence; give at least 4"),
        ({"walkers": 31}, "walkers: 31 for 2 parameters"),
        ({"walkers": 2}, "walkers: 2 for 2 parameters"),
        ({"max_steps": 10}, "max_steps: 10 steps"),
    ],
)
def test_refuses_bad_options(target: Target, options: dict[str, int], message: str) -> None:
    with pytest.raises(fb.InputError, match=message):
        sample_target(target, seed=1, **options)


def test_an_improper_prior_is_not_drawn_from() -> None:
    flat = normal_gamma_target(fb.NormalGamma(mu=0.0, lam=0.0, alpha=-0.5, beta=0.0), SAMPLES)
    tree = sample_target(flat, seed=1)
    assert "prior" not in tree.children
    assert tree.attrs["prior"] == "improper"


def test_progress_is_reported(target: Target) -> None:
    reported: list[tuple[int, int]] = []
    sample_target(target, seed=3, progress=lambda done, due: reported.append((done, due)))
    assert all(done <= due for done, due in reported)
    assert reported[-1][0] == reported[-1][1]
    assert [done for done, _ in reported] == sorted(done for done, _ in reported)


def test_from_a_record() -> None:
    record = short_decay(sampling_rate=200.0, noise_sd=5e-4)
    closed = fb.estimate(record, SYSTEM, random_force="none")
    tree = sample_reference(record, SYSTEM, random_force="none", seed=4)
    friction = tree["posterior"]["friction"]
    error = friction.attrs["mcse_mean"]
    assert float(friction.mean()) == pytest.approx(closed.friction.mean(), abs=5.0 * error)
    assert tree.attrs["friction_unit"] == "N"
    assert tree.attrs["method"] == "waveform"
    assert tree.attrs["wall_time_s"] > 0.0


def two_humps(apart: float, small: float) -> Target:
    """A mixture of two normals that no walker crosses between by steps of its own."""
    near, far = np.zeros(2), np.array([apart, -apart])
    spread = np.diag([1.0, 0.04])
    shares, centres = np.array([1.0 - small, small]), np.array([near, far])

    def log_prob(theta: np.ndarray) -> np.ndarray:
        away = theta[:, None, :] - centres
        return logsumexp(-0.5 * (away**2 / np.diag(spread)).sum(axis=2), b=shares, axis=1)

    centre = shares @ centres
    between = (centres - centre).T @ (shares[:, None] * (centres - centre))
    return replace(
        normal_gamma_target(PRIOR, SAMPLES),
        log_prob=log_prob,
        centre=centre,
        covariance=spread + between,
        humps=tuple((each, spread) for each in centres),
    )


def test_humps_that_lie_apart_have_their_share() -> None:
    """Walkers that start in the lesser of two modes would count as many of the draws for good."""
    share = []
    for seed in range(2):
        run = Ensembles(two_humps(40.0, 0.02), seed=seed, ensembles=4, walkers=32)
        run.advance(600)
        far = run.coordinates(burn_in=100)[..., 0] > 20.0
        share.append(far.mean())
        # every walker has been in the better one
        assert not far.all(axis=1).any()
    # a walker changes its hump every few steps: 128,000 draws count for a tenth at the least
    assert np.mean(share) == pytest.approx(0.02, abs=4.0 * np.sqrt(0.02 * 0.98 / 12_800))
