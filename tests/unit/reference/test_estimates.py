"""An estimate that averages over a random force is sampled part by part."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from fluctuating_force import fluctuating_decay
from friction_bayes.reference import checking, load_tree, save_tree
from friction_bayes.reference.estimates import parts_of, sample_estimate
from friction_bayes.validation.agreement import compare

SYSTEM = fb.Oscillator(mass=2.0, stiffness=200.0)
STEP = 0.02


def record(share: float, seed: int, noise: float = 2e-4) -> xr.DataArray:
    rng = np.random.default_rng(seed)
    values = fluctuating_decay(
        rng,
        frequency=10.0,
        friction=0.001,
        release=0.1,
        step=STEP,
        samples=900,
        force_sd=share * 0.001,
        correlation_time=0.2,
    )[0]
    noisy = values + noise * rng.standard_normal(values.size)
    return fb.make_record(STEP * np.arange(values.size), noisy, "displacement")


@pytest.fixture(scope="module")
def undecided() -> fb.Estimate:
    """With a force of 0.8 % of friction, which the record makes probable and no more.

    Its part is sampled in 2,000 steps. Where a force is as probable as none, its size has a long tail towards
    zero, which takes four times as many; shares are tested to about 0.01 in either case.
    """
    # from a seed on that has both and three parts; each part is sampled, so no more of them are wanted
    found = (fb.estimate(record(0.008, seed, 5e-5), SYSTEM) for seed in range(23, 60))
    return next(one for one in found if 0.9 < one.random_force.probability < 0.97 and len(one.fit.parts) < 4)


@pytest.fixture(scope="module")
def run(undecided: fb.Estimate) -> checking.ReferenceRun:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(checking, "sample_estimate", partial(sample_estimate, ess=150.0))
        return checking.check_estimate(undecided, seed=3)


def test_every_part(undecided: fb.Estimate, run: checking.ReferenceRun, tmp_path) -> None:
    parts, declared = parts_of(run.tree), undecided.fit.parts
    assert len(parts) == len(declared) >= 2
    assert parts[0].attrs["part"] == max(declared, key=lambda part: part.probability).name
    assert {bool(part.attrs["random_force"]) for part in parts} == {True, False}
    for part in parts:
        found = part["posterior"].dataset.data_vars
        assert ("random_force_sd" in found) == ("correlation_time" in found) == part.attrs["random_force"]
    # the mixture has draws of all, in proportion
    mixed = run.tree["mixture"].dataset["friction"]
    assert mixed.dims == ("chain", "draw")
    assert set(mixed.coords) == {"chain", "draw", "walker"}
    total = sum(part.probability for part in declared)
    for part in parts:
        share = np.isin(mixed.values, part["posterior"].dataset["friction"].values).mean()
        (expected,) = (each.probability for each in declared if each.name == part.attrs["part"])
        assert share == pytest.approx(expected / total, abs=4.0 * np.sqrt(0.25 / mixed.size))
    save_tree(run.tree, tmp_path / "reference.nc")
    assert len(parts_of(load_tree(tmp_path / "reference.nc"))) == len(parts)


def test_the_check_is_of_the_mixture(undecided: fb.Estimate, run: checking.ReferenceRun) -> None:
    summary = run.summary
    assert summary["converged"]
    assert summary["checked"] == f"each of {len(undecided.fit.parts)} parts by itself"
    assert summary["rhat"] < 1.01
    assert summary["agrees"] is True, summary["because"]
    assert abs(summary["difference_in_sd"]) < 0.05


def test_a_part_that_does_not_count_is_not_sampled() -> None:
    """Two of six accounts count here; a mixture of three is sampled above."""
    certain = record(0.1, 1, 5e-5)
    closed = fb.estimate(certain, SYSTEM)
    tree = sample_estimate(closed, seed=3, ess=150.0)
    parts = parts_of(tree)
    assert len(parts) == len(closed.fit.parts) < len(closed.fit.accounts)
    assert all(part.attrs["random_force"] == 1 for part in parts)
    verdict = compare(
        closed.friction_of_parts,
        tree["mixture" if len(parts) > 1 else "posterior"]["friction"].values.reshape(
            4, tree.attrs["walkers"], -1
        ),
        minimum_ess=150.0,
        false_alarm_rate=1e-4,
    )
    assert verdict.agrees, verdict.because
    without = fb.sample_reference(certain, SYSTEM, random_force="none", seed=3, ess=150.0)
    assert without.attrs["random_force"] == 0
    assert without.attrs["friction_unit"] == "N"
    assert float(without["posterior"]["friction"].std()) < 0.5 * closed.friction.std()
