"""``check`` adds the sampler and changes no other number."""

from __future__ import annotations

from typing import Any

import pytest

import friction_bayes as fb
from decays import SYSTEM, fluctuating_friction, slow_decay

EFFECTS = ["viscous_damping", "sensor_offset", "random_force"]


def releases(count: int, *, unsteady: bool) -> list[Any]:
    # one record shows a random force only where it is as large as friction
    force = fluctuating_friction(1.0 if count == 1 else 0.3)
    return [
        slow_decay(
            initial_displacement=0.0147 - 0.001 * k,
            # without a force each step of the sampler integrates the motion
            duration=12.0 if unsteady else 8.0,
            sampling_rate=60.0,
            seed=k,
            effects=force if unsteady else {},
        )
        for k in range(count)
    ]


@pytest.mark.parametrize("unsteady", [False, True])
@pytest.mark.parametrize("count", [1, 2])
def test_every_other_number_stays(count: int, unsteady: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Under a force a chain takes thousands of steps, and few are made here.

    That both agree there is tested in ``test_random_force_check.py`` and ``test_records_sampled.py``.
    """
    if unsteady:
        monkeypatch.setattr("friction_bayes.loop.checks.sampler_check._MOST_STEPS", 150)
    records = releases(count, unsteady=unsteady)
    plain, checked = (
        fb.close_loop(records, SYSTEM, seed=1, effects=EFFECTS, check=check).to_dict()
        for check in (False, True)
    )
    assert plain.pop("reference_check") is None
    sampler = checked.pop("reference_check")["sampler"]
    for report in (plain, checked):
        report.pop("elapsed_s")
    assert checked == plain
    assert ("random_force" in [effect["name"] for effect in plain["effects"]]) == unsteady
    # what was sampled is said, and is a part of the posterior
    assert sampler["sampled"]["effects"] == [effect["name"] for effect in plain["effects"]]
    assert 0.1 < sampler["sampled"]["probability"] <= plain["candidates"][0]["probability"] + 1e-9
    assert sampler["steps"] >= 150
    if not unsteady:
        assert sampler["converged"]
        assert sampler["agrees"], sampler["because"]


def test_friction_that_differs_is_sampled_too() -> None:
    records = [slow_decay(friction=f, duration=12.0, sampling_rate=60.0, seed=3) for f in (0.066, 0.074)]
    found = fb.close_loop(records, SYSTEM, seed=1, effects=EFFECTS, varying_friction=True, check=True)
    assert found.reference_check is not None
    sampler = found.reference_check["sampler"]
    sampled, closed = sampler["friction"], sampler["closed_form"]
    # the closed form has the prior of what differs in units of the noise: two hundredths of its sd
    assert sampled["mean"] == pytest.approx(closed["mean"], abs=0.1 * closed["sd"])
    assert sampled["sd"] == pytest.approx(closed["sd"], rel=0.06)
