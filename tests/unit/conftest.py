"""A closed loop written out by hand: what faces need, without a fit."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from friction_bayes.core.arrays import Array
from friction_bayes.loop.report.result import FluctuationTrace, Forecast, LoopReport, RecordTrace


def summary(mean: float, sd: float, unit: str = "N") -> dict[str, object]:
    return {"mean": mean, "sd": sd, "interval90": [mean - 1.645 * sd, mean + 1.645 * sd], "unit": unit}


def trace(rng: np.random.Generator, name: str = "a record", noise_sd: float = 1e-4) -> RecordTrace:
    """Ten cycles of a decay whose amplitude falls faster at first; the Coulomb model takes a constant."""
    time = np.arange(600) / 100.0
    turns = np.arange(20) * np.pi / 10.0
    size = 0.02 * np.exp(-0.05 * np.arange(20))
    line = np.linspace(size[0], size[-1], 20)
    sign = (-1.0) ** np.arange(20)
    after = np.interp(time, turns, size) * np.cos(10.0 * time)
    before = np.interp(time, turns, line) * np.cos(10.0 * time)
    signal = after + rng.normal(0.0, noise_sd, time.size)

    def ahead(by: Array) -> Forecast:
        return Forecast(
            time=time[420:],
            signal=signal[420:],
            mean=by[420:],
            sd=np.full(180, noise_sd),
            free=np.ones(180, np.bool_),
        )

    return RecordTrace(
        name=name,
        unit="m",
        quantity="displacement",
        time=time,
        signal=signal,
        before=before,
        after=after,
        sides=np.zeros(time.size),
        phase=np.interp(time, turns, np.arange(20.0)),
        turning_times_before=turns,
        turning_points_before=sign * line,
        turning_times=turns,
        turning_points=sign * size,
        fluctuation=FluctuationTrace(
            force=rng.normal(0.0, 0.1, time.size),
            sd=np.full(time.size, 0.05),
            displacement=after,
            velocity=np.gradient(after, time),
            friction=0.5,
            unit="N",
        ),
        forecasts=(ahead(before), ahead(after)),
    )


@pytest.fixture
def loop_report(rng: np.random.Generator) -> LoopReport:
    """Two effects that tie."""
    tests = {"rms": 1e-4, "false_alarm_rate": 0.01}
    draws = np.concatenate([rng.normal(0.5, 0.01, 700), rng.normal(0.6, 0.01, 300)])
    mixture = xr.Dataset(
        {
            "friction": (("chain", "draw"), draws[None]),
            "candidate": (("chain", "draw"), np.repeat([0, 1], [700, 300])[None]),
        }
    )
    channel = {"statistic": 80.0, "degrees": 7, "p_value": 1e-14}
    return LoopReport(
        verdict="ambiguous",
        effects=[
            {
                "name": "viscous_damping",
                "probability": 0.71,
                "parameters": {"damping_ratio": {"mean": 0.002, "sd": 5e-5, "unit": "1"}},
                "lines": [],
            }
        ],
        candidates=[
            {"effects": ["viscous_damping"], "probability": 0.7},
            {"effects": ["friction_drift"], "probability": 0.29},
            {"effects": ["viscous_damping", "quadratic_drag"], "probability": 0.01},
            {"effects": [], "probability": 0.0},
        ],
        friction_before=summary(0.65, 0.001),
        friction_after=summary(0.53, 0.05),
        dry_friction={"probability": 0.99, "upper95": 0.6, "unit": "N"},
        prior_sensitivity={"0.1": 0.12, "10": -0.03},
        held_out_error={
            "before": 4e-4,
            "after": 1e-4,
            "noise_floor": 1e-4,
            "unit": "m",
            "what": "root mean square error over the rest",
        },
        residual={
            "before": tests
            | {
                "passes": False,
                "failed": ["whiteness"],
                "channels": {"whiteness": channel, "tails": channel},
            },
            "after": tests
            | {"passes": True, "failed": [], "channels": {"whiteness": channel | {"p_value": 0.4}}},
        },
        noise={"model": "ar", "order": 3, "sd": 1e-4, "correlation_length_s": 0.02},
        paper_procedure={
            "friction": summary(0.7, 0.1),
            "disagrees": True,
            "because": ["viscous_damping", "telescoping_drops"],
        },
        frequency={
            "mean": 10.0,
            "sd": 1e-3,
            "declared": 10.1,
            "unit": "rad/s",
            "from_stiffness": None,
            "from_mass": None,
            "trusted": None,
        },
        witnesses={"loss": summary(0.5, 0.06), "shape": summary(-0.2, 0.02), "agree": False},
        random_force={
            "sd": summary(0.1, 0.01),
            "share_of_friction": 0.2,
            "correlation_time_s": summary(0.05, 0.01, "s"),
            "probability": 0.99,
        },
        left={
            "record": "r",
            "structured_rms": 1e-5,
            "unit": "m",
            "share_of_amplitude": 5e-4,
            "friction_could_shift_by": 0.01,
            "depends_on": None,
            "shape": None,
            "share": None,
        },
        fitted={"from_s": 0.0, "to_s": 6.0, "samples": 600, "half_cycles": 19, "set_aside": 0},
        next_experiment="Add a record released from half the amplitude.",
        reference_check={
            "friction": 0.5,
            "error_before": 0.3,
            "error_after": 0.06,
            "within_interval90": True,
        },
        elapsed_s=1.0,
        seed=3,
        trail=["with 1: viscous_damping is most probable"],
        traces=(trace(rng),),
        posterior=xr.DataTree.from_dict({"mixture": mixture}),
    )
