"""Mass or stiffness is declared wrongly and the other trusted: the report is that of the right system."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import friction_bayes as fb

RIGHT = fb.Oscillator(mass=10.0, stiffness=1300.0)
WRONG = {
    "mass": replace(RIGHT, stiffness=1000.0, trust="mass"),
    "stiffness": replace(RIGHT, mass=13.0, trust="stiffness"),
}
FRICTION = 2.0


def numbers(found: Any, place: str = "") -> dict[str, float]:
    """Numbers within a part of a report, by place."""
    if isinstance(found, dict):
        found = [(f"{place}.{name}", part) for name, part in found.items()]
    elif isinstance(found, list | tuple):
        found = [(f"{place}.{i}", part) for i, part in enumerate(found)]
    else:
        return {place: found} if isinstance(found, int | float) else {}
    return {name: number for at, part in found for name, number in numbers(part, at).items()}


@cache
def forces(system: fb.Oscillator) -> dict[str, float]:
    """Every force that is reported of a record with a random force and a measured one."""
    record = fb.simulate(
        RIGHT,
        friction=FRICTION,
        initial_displacement=0.05,
        duration=4.0,
        sampling_rate=50.0,
        noise_sd=1e-4,
        seed=1,
        effects={"random_force.sd": 0.3, "random_force.correlation_time": 0.1},
    )
    force = FRICTION * np.sign(np.gradient(record.values))
    report = fb.close_loop(record, system, seed=1, effects=("random_force",), reference_force=force)
    trace = report.traces[0].fluctuation
    assert trace is not None
    own = ("witnesses", "random_force", "effects", "left", "dry_friction", "residual")
    return numbers(
        {name: getattr(report, name) for name in own}
        | {"friction": report.friction_after, "before": report.friction_before}
        | {"trace": [trace.friction, float(trace.force.std()), float(trace.sd.mean())]}
    )


@cache
def unexplained(system: fb.Oscillator) -> dict[str, float]:
    """Friction and forces of a damped record under sets without damping."""
    record = fb.simulate(
        RIGHT,
        friction=1.0,
        initial_displacement=0.05,
        duration=6.0,
        sampling_rate=50.0,
        noise_sd=1e-4,
        seed=1,
        effects={"viscous_damping.damping_ratio": 0.02},
    )
    report = fb.close_loop(record, system, seed=1, effects=("sensor_offset",), random_force="none")
    assert report.verdict == "unexplained"
    return numbers({"range": report.friction_range, "left": report.left, "dry": report.dry_friction})


@pytest.mark.parametrize("said", [forces, unexplained])
@pytest.mark.parametrize("trust", WRONG)
def test_every_force_is_of_the_trusted_value(
    trust: str, said: Callable[[fb.Oscillator], dict[str, float]]
) -> None:
    assert said(WRONG[trust]) == pytest.approx(said(RIGHT), rel=0.03, abs=0.01)
