"""Closed forms against emcee: what the three columns show, and that a wrong closed form shows in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from experiments import against_emcee, noise_sweep, prior_sweep, random_force_verdict
from experiments.against_emcee import (
    SAMPLED,
    sampled_pair,
    three_columns,
    verdict_rows,
    what_was_checked,
    word,
)
from experiments.runner import Experiment, _cell_seed

PRIOR = fb.NormalGamma(0.5, 0.05, 1.0, 0.02)


def checked(**columns: list[float]) -> xr.Dataset:
    """Two methods on four records, of which emcee saw two."""
    names = {name: [1.0, 1.0] for name in SAMPLED} | columns
    values = {name: np.array([[*pair, np.nan, np.nan]] * 2) for name, pair in names.items()}
    data = {name: (("method", "replicate"), column) for name, column in values.items()}
    return xr.Dataset(data, coords={"method": ["one", "other"]})


def test_columns_tell_the_worst_and_count_the_verdicts() -> None:
    dataset = checked(
        rhat=[1.0012, 1.0004],
        ess_bulk=[9000.0, 8000.0],
        ess_tail=[5000.0, 7000.0],
        agrees=[1.0, 0.0],
        shift=[-0.02, 0.04],
        width_ratio=[0.98, 1.01],
        converged=[1.0, 0.0],
    )
    one = dataset.sel({"method": "one"})
    assert three_columns(one) == {
        "R-hat": "1.0012",
        "ESS bulk/tail": "8000/5000",
        "emcee against ours": "agrees in 1 of 2, mean +0.010 ± 0.030 sd, 90 % width × 0.995, "
        "precision agrees in 2 of 2, converged in 1 of 2",
    }
    assert word(one).endswith("; R-hat 1.0012, ESS 8000/5000")
    assert word(one.isel(replicate=slice(2, None))) == ""
    assert [row.ours for row in verdict_rows(dataset)] == ["1 of 2", "1 of 2"]
    more = dataset.assign({f"{name}_without": each for name, each in dataset.isel(method=0).items()})
    assert what_was_checked(more) == (
        "Checked by emcee: 6 posteriors, 3 of them converged (over all, R-hat at most 1.0012, ESS "
        "bulk/tail at least 8000/5000); the closed form agrees in 3 of 6 judged, false alarms 1 % each."
    )
    unchecked = dataset.isel(replicate=slice(2, None)), dataset.drop_vars(SAMPLED)
    assert {what_was_checked(each) for each in unchecked} == {"No posterior here was checked by a sampler."}


def test_what_was_not_judged_is_no_verdict() -> None:
    dataset = checked(agrees=[np.nan, 1.0], precision_agrees=[np.nan, np.nan])
    assert word(dataset.isel(method=0)).startswith("agrees in 1 of 1 judged of 2, mean")
    assert "precision" not in word(dataset.isel(method=0))
    (row, _) = verdict_rows(dataset)
    assert (row.ours, row.remark) == ("1 of 1", "2 converged; false alarms 1 % each; 1 not judged")


def test_a_wrong_closed_form_shows(rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch) -> None:
    samples = rng.normal(0.1, 0.2, 30)
    right = sampled_pair(PRIOR, samples, seed=1)
    # five Monte Carlo standard errors
    assert abs(right["shift"]) < 5.0 / np.sqrt(right["ess_bulk"])
    assert right["converged"] == 1.0
    # as if the closed form had forgotten a fifth of an sd of its mean
    target = against_emcee.normal_gamma_target
    apart = 0.2 * float(PRIOR.update(samples).friction.std())
    monkeypatch.setattr(against_emcee, "normal_gamma_target", lambda prior, x: target(prior, x + apart))
    wrong = sampled_pair(PRIOR, samples, seed=1)
    assert wrong["agrees"] == 0.0
    assert wrong["shift"] == pytest.approx(0.2, abs=0.06)


@pytest.mark.parametrize(
    "experiment",
    [noise_sweep.EXPERIMENT, prior_sweep.EXPERIMENT, random_force_verdict.EXPERIMENT],
    ids=lambda experiment: experiment.name,
)
def test_what_is_checked_changes_no_record(experiment: Experiment) -> None:
    fewer = replace(experiment, config=replace(experiment.config, checked=1))
    cells, of_fewer = (each.cells(each.config, False) for each in (experiment, fewer))
    assert sum(cell["check"] for cell in cells) > sum(cell["check"] for cell in of_fewer)
    seeds, others = (
        [_cell_seed(each, cell, 1).entropy for cell in its[:300]]
        for each, its in ((experiment, cells), (fewer, of_fewer))
    )
    assert seeds == others
