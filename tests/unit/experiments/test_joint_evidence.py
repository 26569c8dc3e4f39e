"""Errors of several records together, and records that experiments share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from experiments import (
    acceptance_roc,
    data_used,
    example_choices,
    gamma_exponential,
    method_comparison,
    noise_sweep,
    random_force_verdict,
    reduced_data_set,
    residuals_traced,
    sampling_rate_sweep,
    shown_records,
)
from experiments.joint_evidence import together
from experiments.runner import _cell_seed


def test_combined_test_has_its_level(rng: np.random.Generator) -> None:
    sizes = abs(rng.normal(size=(3, 200)))
    found = [together(sizes, abs(rng.normal(size=3))).fisher for _ in range(2000)]
    # 2000 repetitions give a share of a tenth to 0.7 %
    assert np.mean(np.array(found) < 0.1) == pytest.approx(0.1, abs=0.03)


@pytest.mark.parametrize("draws", [3, 1], ids=["noise of its own", "one draw scaled"])
def test_errors_are_those_of_repeated_samples(draws: int, rng: np.random.Generator) -> None:
    stated = (0.1, 0.02, 0.3)
    levels = np.ones((3, 1))
    found = [together(levels * abs(rng.normal(size=(draws, 200))), stated) for _ in range(300)]
    scatter = np.std([joint.fisher for joint in found], ddof=1)
    assert scatter == pytest.approx(np.mean([joint.fisher_error for joint in found]), rel=0.3)
    product = np.std([joint.product for joint in found], ddof=1)
    expected = np.mean([joint.product * joint.relative_error for joint in found])
    assert product == pytest.approx(expected, rel=0.3)


def test_the_example_is_one_set_of_records() -> None:
    asked = (
        (noise_sweep.EXPERIMENT, {"snr_db": 21.59, "check": True}),
        (example_choices.EXPERIMENT, {"choice": "100 Hz", "check": False}),
        (gamma_exponential.EXPERIMENT, {"friction": 0.07, "check": False}),
        (data_used.EXPERIMENT, {"check": True}),
        (shown_records.EXPERIMENT, {"case": "example", "run": "example"}),
        (method_comparison.EXPERIMENT, {"condition": "sampling rate: 1000 Hz", "check": True}),
        (random_force_verdict.EXPERIMENT, {"condition": "no force", "size": 0.0, "check_forced": True}),
    )
    seeds = [
        {int(_cell_seed(one, cell | {"replicate": i}, 1).generate_state(1)[0]) for one, cell in asked}
        for i in range(2)
    ]
    assert [len(found) for found in seeds] == [1, 1]
    assert seeds[0] != seeds[1]
    assert noise_sweep.noise_of(21.59, noise_sweep.Config()) == 5e-4


def test_one_condition_has_one_record_wherever_it_is_asked() -> None:
    cells = (
        (reduced_data_set.EXPERIMENT, {"data_set": "2-reduced", "replicate": 3, "check": False}),
        (
            sampling_rate_sweep.EXPERIMENT,
            {"sampling_rate": 1000.0, "quantity": "acceleration", "replicate": 3, "check": True},
        ),
        (residuals_traced.EXPERIMENT, {"sampling_rate": 1000.0, "replicate": 3}),
        (acceptance_roc.EXPERIMENT, {"replicate": 3, "check": False}),
        (random_force_verdict.EXPERIMENT, {"condition": "testbed, as chosen", "replicate": 3}),
    )
    seeds = {int(_cell_seed(experiment, cell, 1).generate_state(1)[0]) for experiment, cell in cells}
    assert len(seeds) == 1
    own = replace(cells[0][0], common_records=False)
    assert int(_cell_seed(own, cells[0][1], 1).generate_state(1)[0]) not in seeds
