"""Laplace's evidence against bridge sampling, and stated probabilities against frequencies."""

from __future__ import annotations

import pytest

import friction_bayes as fb
from decays import SYSTEM, long_decay
from experiments.loop_evidence import Config, fit_of_case
from experiments.simulation.bridge import bridged_log_evidence
from experiments.simulation.laplace_evidence import log_evidence

SHORT = Config(duration=4.0, steps=210)


@pytest.mark.parametrize("case", ["two dampings that are not there", "viscous damping"])
def test_laplace_agrees_with_bridge_sampling(case: str, seed: int) -> None:
    """Within five Monte Carlo errors and 0.2, a fifth of what would change odds noticeably."""
    fit = fit_of_case(case, SHORT, seed)
    bridged = bridged_log_evidence(fit, seed, steps=SHORT.steps)
    assert bridged.error < 0.1
    assert log_evidence(fit) == pytest.approx(bridged.value, abs=0.2 + 5.0 * bridged.error)


def test_sampled_posterior_agrees_with_the_normal_approximation() -> None:
    effects = {"cubic_stiffness.cubic_stiffness": 6e4}
    record = long_decay(initial_displacement=0.04, duration=5.0, seed=11, effects=effects)
    report = fb.close_loop([record], SYSTEM, seed=2, effects=["cubic_stiffness"], check=True)
    assert report.reference_check is not None
    check = report.reference_check["sampler"]
    assert check["converged"]
    assert check["rhat"] < 1.01
    assert check["agrees"]
    assert check["friction"]["sd"] == pytest.approx(check["closed_form"]["sd"], rel=0.2)
