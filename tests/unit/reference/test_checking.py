"""The check of an estimate: its verdict, and when there is none."""

from __future__ import annotations

import json
from functools import partial

import pytest

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.cli.tables.estimate import disagreements, estimate_table
from friction_bayes.core.strict_json import strict_json
from friction_bayes.reference import checking
from friction_bayes.validation.agreement import compare


@pytest.fixture(scope="module")
def estimate() -> fb.Estimate:
    return fb.estimate(short_decay(duration=6.0, seed=5), SYSTEM, method="normal-gamma")


def test_no_verdict_is_null_and_said_so(estimate: fb.Estimate, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checking, "compare", partial(compare, minimum_ess=1e6))
    summary = checking.check_estimate(estimate, seed=1).summary
    assert summary["agrees"] is None
    assert "not judged" in summary["because"]
    result = estimate.to_dict(summary)
    assert json.loads(strict_json(result))["reference"]["agrees"] is None
    reported = estimate_table(result).columns[1]._cells
    assert any("NOT JUDGED" in str(cell) and "DOES NOT AGREE" not in str(cell) for cell in reported)
    assert "NOT JUDGED" in str(disagreements([result])[0])


def test_verdict_and_time(estimate: fb.Estimate) -> None:
    summary = checking.check_estimate(estimate, seed=1).summary
    assert summary["agrees"] is True, summary["because"]
    assert summary["sampler_s"] > 0.0
    assert summary["seed"] == 1
    closed, sampled = estimate.friction, summary["friction"]["mean"]
    assert summary["difference_in_sd"] == pytest.approx((sampled - closed.mean()) / closed.std(), abs=1e-9)
    reported = estimate_table(estimate.to_dict(summary)).columns[1]._cells
    assert any(f"means {abs(summary['difference_in_sd']):.2f} sd apart" in str(cell) for cell in reported)
