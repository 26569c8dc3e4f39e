"""A law identified on the first 37 s of a pendulum's decay: how well does it forecast the 18 s after?

Kaheman et al. (HardwareX 15, 2023) cut one decay into four identification and two validation segments and
publish a viscous law. Here each law is identified on the first four together; on a validation segment it is
given the initial state that fits the first period best, and forecasts the rest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import least_squares

import friction_bayes as fb
from experiments.runner import Cell, Experiment, Row, main
from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.core.text import number, set_words
from friction_bayes.decay.free_decay import find_free_decay
from friction_bayes.mechanics.effects import force_effects
from friction_bayes.mechanics.effects.encoder_eccentricity import ENCODER_ECCENTRICITY
from friction_bayes.mechanics.effects.presliding import PRESLIDING
from friction_bayes.mechanics.integrate import integrate

__all__ = ["EXPERIMENT", "Config", "Law", "forecast", "identified"]

SET = "map-single-pendulum"
PUBLISHED = "published: viscous, no dry friction"
PUBLISHED_COEFFICIENT = 2.23940125e-4
"""N m s, as published."""
TARGETS = {"validation-1": 0.25, "validation-2": 0.25}
# They belong to a record and not to the pendulum: nothing to carry into the next segment.
BOUND_TO_A_RECORD = (
    "friction_drift",
    "curved_friction_drift",
    "sensor_drift",
    "curved_sensor_drift",
    "periodic_interference",
    "outliers",
)


@dataclass(frozen=True)
class Config:
    """Identification segments, forecast segments, and what may be tried on the first."""

    identification: tuple[str, ...] = (
        "identification-1",
        "identification-2",
        "identification-3",
        "identification-4",
    )
    validation: tuple[str, ...] = tuple(TARGETS)
    points: int = 1500


@dataclass(frozen=True)
class Law:
    """A pendulum with numbers in it.

    Attributes
    ----------
    system : Oscillator
        With the frequency that was found.
    friction : float
        N m.
    effects : mapping of str to float
        ``{"NAME.PARAMETER": value}`` of force effects.
    offset : float
        Of the sensor [rad].
    eccentricity : mapping of str to float
        Coefficients of its error that repeats with every turn [rad].
    """

    system: Oscillator
    friction: float
    effects: Mapping[str, float]
    offset: float
    eccentricity: Mapping[str, float] = field(default_factory=dict)

    def angle(self, state: Sequence[float], time: Array) -> Array:
        """Angle over time from an initial angle and angular velocity [rad]."""
        motion = integrate(
            self.system, self.friction, state[0], state[1], time, dict(self.effects), rtol=1e-9
        )
        wrong = ENCODER_ECCENTRICITY.distort(
            motion.displacement, time, *ENCODER_ECCENTRICITY.values(self.eccentricity)
        )
        return np.asarray(wrong + self.offset)


ALLOWED: dict[str, tuple[str, ...]] = {
    PUBLISHED: (),
    "Coulomb alone": ("sensor_offset",),
    "viscous damping": ("sensor_offset", "viscous_damping"),
    "quadratic drag": ("sensor_offset", "quadratic_drag"),
    "quadratic drag, Stribeck": ("sensor_offset", "quadratic_drag", "stribeck_friction"),
    "quadratic drag, Stribeck, pre-sliding": (
        "sensor_offset",
        "quadratic_drag",
        "stribeck_friction",
        PRESLIDING.name,
    ),
    "the catalogue": (),
}
"""Effects that each law may have; empty for all that do not belong to a record."""


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """One cell a law; ``full`` changes nothing."""
    del config, full
    return [{"law": law, "noise": noise} for law in ALLOWED for noise in _noises(law)]


def _noises(law: str) -> tuple[str, ...]:
    return ("none",) if law == PUBLISHED else ("white", "auto")


def identified(report: fb.LoopReport, system: Oscillator) -> Law:
    """Take the most probable candidate of a joint fit, at its posterior medians."""
    draws = report.posterior["posterior"].dataset
    middle = {str(name): float(draws[name].median()) for name in draws.data_vars}
    forces = {effect.name for effect in force_effects()}
    offsets = [value for name, value in middle.items() if name.startswith("sensor_offset.")]
    assert system.inertia is not None
    return Law(
        system=replace(system, inertia=system.inertia * math.exp(-2.0 * middle["log_frequency_ratio"])),
        friction=middle["friction"],
        effects={name: value for name, value in middle.items() if name.split(".")[0] in forces},
        offset=float(np.mean(offsets)) if offsets else 0.0,
        eccentricity={
            name.split(".")[1]: value
            for name, value in middle.items()
            if name.startswith(ENCODER_ECCENTRICITY.name)
        },
    )


def published(system: Oscillator) -> Law:
    """The law of the data's authors."""
    assert system.inertia is not None
    zeta = 0.5 * PUBLISHED_COEFFICIENT / math.sqrt(system.stiffness * system.inertia)
    return Law(system=system, friction=0.0, effects={"viscous_damping.damping_ratio": zeta}, offset=0.0)


def forecast(law: Law, record: xr.DataArray) -> tuple[Array, int]:
    """Angle over a record from the state that fits its first period best, and the samples of that period."""
    time = record["time"].values - float(record["time"][0])
    values = np.asarray(record.values, dtype=np.float64)
    first = round(2.0 * math.pi / find_free_decay(record, law.system).frequency / float(time[1]))
    speed = np.polyfit(time[: first // 5], values[: first // 5], 4)[-2]

    def misfit(state: Array) -> Array:
        return law.angle(state, time[:first]) - values[:first]

    found = least_squares(misfit, [values[0] - law.offset, speed], x_scale="jac")
    return law.angle(found.x, time), first


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Identify one law on the first segments and forecast the last."""
    read = {part: fb.dataset_record(f"{SET}/{part}") for part in (*config.identification, *config.validation)}
    system = read[config.identification[0]][1]
    fields: dict[str, Any] = dict.fromkeys(("effects", "parameters", "verdict", "failed", "rival"), "")
    fields["residual"] = None
    if cell["law"] == PUBLISHED:
        law = published(system)
        fields["effects"] = "viscous damping"
    else:
        allowed = ALLOWED[cell["law"]]
        choice: dict[str, Any] = {"effects": allowed} if allowed else {"exclude": BOUND_TO_A_RECORD}
        report = fb.close_loop(
            [read[part][0] for part in config.identification],
            system,
            seed=int(seed.generate_state(1)[0]),
            noise=cell["noise"],
            **choice,
        )
        law = identified(report, system)
        after = report.residual["after"]
        fields |= {
            "effects": set_words(report.candidates[0]["effects"]),
            "verdict": report.verdict,
            "rival": _rival(report.candidates),
            "failed": ", ".join(after["failed"]),
            "residual": after["rms"],
        }
    fields["parameters"] = _parameters(law)
    for part in config.validation:
        record = read[part][0]
        predicted, first = forecast(law, record)
        error = record.values - predicted
        fields[f"{part}.rms"] = float(np.sqrt(np.mean(error[first:] ** 2)))
        stride = math.ceil(error.size / config.points)
        fields[f"{part}.error"] = error[::stride].tolist()
    return fields


def _rival(candidates: Sequence[Mapping[str, Any]]) -> str:
    """The next candidate, and by how much it is less probable."""
    if len(candidates) < 2 or not candidates[1]["probability"] > 0.0:
        return "none"
    ratio = candidates[0]["probability"] / candidates[1]["probability"]
    return f"{set_words(candidates[1]['effects'])}, {ratio:.2g} times less probable"


def _parameters(law: Law) -> str:
    parts = [f"friction {number(law.friction, 4)} N m"]
    parts += [
        f"{name.split('.')[1].replace('_', ' ')} {number(value, 3)}" for name, value in law.effects.items()
    ]
    parts.append(f"w0 {law.system.natural_frequency:.4f} rad/s")
    return "; ".join(parts)


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """One entry a law, one column a validation segment."""
    segments = list(TARGETS)
    dataset = xr.Dataset(coords={"segment": segments})
    for name in ("law", "noise"):
        dataset[name] = ("case", [str(cell[name]) for cell in cells])
    for name in ("effects", "parameters", "verdict", "failed", "rival"):
        dataset[name] = ("case", [str(result[name]) for result in results])
    residual = [math.nan if result["residual"] is None else result["residual"] for result in results]
    dataset["residual"] = ("case", residual)
    rms = np.array([[result[f"{part}.rms"] for part in segments] for result in results])
    dataset["rms"] = (("case", "segment"), rms)
    dataset["ratio"] = (("case", "segment"), rms / rms[0])
    longest = max(len(results[0][f"{part}.error"]) for part in segments)
    error = np.full((len(results), len(segments), longest), np.nan)
    for i, result in enumerate(results):
        for j, part in enumerate(segments):
            error[i, j, : len(result[f"{part}.error"])] = result[f"{part}.error"]
    dataset["error"] = (("case", "segment", "sample"), error)
    return dataset


def rows(dataset: xr.Dataset) -> list[Row]:
    """RMS angle error of each law and of the published one, treated the same way."""
    target = ", ".join(f"<= {value:g}" for value in TARGETS.values())
    table = []
    for k in range(dataset.sizes["case"]):
        case = dataset.isel(case=k)
        rms = " / ".join(f"{1e3 * float(value):.3g}" for value in case["rms"].values)
        ratio = " / ".join(f"{float(value):.3f}" for value in case["ratio"].values)
        own = case["law"].item() != PUBLISHED
        reached = all(float(case["ratio"].sel(segment=part)) <= limit for part, limit in TARGETS.items())
        noise = f", noise {case['noise'].item()}" if own else ""
        table.append(
            Row(
                f"{case['law'].item()}{noise}",
                f"{rms} mrad",
                f"{ratio} (target {target})" if own else "1",
                f"{case['effects'].item()}; {'reached' if reached else 'missed'}" if own else "",
            )
        )
    return table


def details(dataset: xr.Dataset) -> list[dict[str, str]]:
    """The numbers of each law."""
    return [
        {
            "law": f"{case['law'].item()}, {case['noise'].item()}",
            "effects": case["effects"].item(),
            "parameters": case["parameters"].item(),
            "next candidate": case["rival"].item(),
            "residual of identification": f"{1e3 * float(case['residual']):.3g} mrad",
            "tests that fail there": case["failed"].item() or "none",
        }
        for case in (dataset.isel(case=k) for k in range(1, dataset.sizes["case"]))
    ]


EXPERIMENT = Experiment(
    name="pendulum_forecast",
    question="how well does a law identified on four segments of a decay forecast the next two?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="over the published",
    group="measured",
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
