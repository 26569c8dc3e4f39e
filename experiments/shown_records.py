"""What the paper's figures show of single records: signals, priors, posteriors. Figs. 2, 3 and 6 to 14."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.against_emcee import SAMPLED, sampled, word
from experiments.paper_numbers import printed
from experiments.reduced_data_set import DATA_SETS, last_begins, last_part
from experiments.rig import Rig, measured_reference, refined_force, run_rig, system_of
from experiments.runner import Cell, Experiment, main
from experiments.sampling_rate_sweep import down_sampled
from experiments.tables import Row
from experiments.testbed_choices import DRAWN_PRIOR
from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.testbed import PAPER_SYSTEM, paper_example

__all__ = ["EXPERIMENT", "Config"]


SERIES = ("signal", "estimated", "force", "coulomb")
"""Over time: the record, the response of the estimated friction, the refined force and Coulomb's."""
NUMBERS = (
    "reference",
    "friction",
    "friction_low",
    "friction_high",
    "precision",
    "level_prior",
    "level_posterior",
    *SAMPLED,
)
RATE_PRIOR = {"alpha": 1.0, "kappa": 0.2}
"""Prior of the gamma-exponential pair that can be drawn: worth one sample of 0.2 N."""


@dataclass(frozen=True)
class Config:
    """The share kept of data set 2, the grids that densities are drawn on, and whether emcee runs."""

    rig: Rig = field(default_factory=Rig)
    last_share: float = 0.2
    grid: int = 121
    peaks: tuple[str, ...] = ("highest", "nominal")
    check: bool = True


CASES = ("example", "1", "2", "2-reduced, 1000 Hz", "2-reduced, 100 Hz", "2-reduced, 10 Hz")


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """One case a cell, of the first run of all experiments; all of data set 2 are cut from one."""
    return [
        {"case": case, "run": case.split(",")[0].removesuffix("-reduced"), "replicate": 0} for case in CASES
    ]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """One record, and the results of the paper's procedure."""
    of_noise, of_sampler = seed.generate_state(2).tolist()
    rig, case = config.rig, cell["case"]
    found: dict[str, Any] = {"peaks": list(config.peaks)}
    if case == "example":
        record, system, reference = paper_example(of_noise), PAPER_SYSTEM, printed("example-friction")
        found["time"] = []
    else:
        signals = run_rig(rig, DATA_SETS[cell["run"]], seed=of_noise)
        system, reference = system_of(rig), measured_reference(rig, signals["friction_force"])
        record = signals["acceleration"]
        if "reduced" in case:
            rate = float(case.split(", ")[1].removesuffix(" Hz"))
            begin = last_begins(record, config.last_share)
            record = down_sampled(
                last_part(record, config.last_share), round(rig.sampling_rate / rate), of_noise
            )
            found["begin"] = begin
        found["time"] = record["time"].values.tolist()
        found["signal"] = record.values.tolist()
    for peaks in config.peaks:
        estimate = fb.estimate(record, system, method="normal-gamma", peaks=peaks, prior=DRAWN_PRIOR)
        _append(found, _pair(estimate, reference, of_sampler if config.check else None, config.grid))
    if case in DATA_SETS:
        found |= _responses(rig, signals, float(found["friction"][0]), reference)
    if case == "example":
        found |= _rate_pair(record, config.grid)
    return found


def _append(found: dict[str, Any], figures: Mapping[str, Any]) -> None:
    for name, value in figures.items():
        held = found.setdefault(name, [])
        held.extend(value) if isinstance(value, list) else held.append(value)


def _pair(estimate: fb.Estimate, reference: float, seed: int | None, grid: int) -> dict[str, Any]:
    """Prior and posterior of the normal-gamma pair on their own grids, and emcee's word on the posterior."""
    prior, posterior = fb.NormalGamma(**estimate.prior), estimate.fit.posterior
    figures: dict[str, Any] = {}
    for stage, pair in (("prior", prior), ("posterior", posterior)):
        low, high = pair.friction.interval(0.99 if stage == "posterior" else 0.95)
        friction = np.linspace(low, high, grid)
        precision = np.linspace(0.0, float(pair.precision.ppf(0.997)), grid + 1)[1:]
        density = np.exp(pair.logpdf(friction[None, :], precision[:, None]))
        figures |= {
            f"{stage}_friction": friction.tolist(),
            f"{stage}_precision": precision.tolist(),
            f"{stage}_density": density.ravel().tolist(),
            f"{stage}_friction_pdf": pair.friction.pdf(friction).tolist(),
            f"{stage}_precision_pdf": pair.precision.pdf(precision).tolist(),
            f"level_{stage}": math.exp(pair.credible_level(0.9)),
        }
    low, high = estimate.friction.interval(0.9)
    return figures | {
        "reference": reference,
        "friction": float(estimate.friction.mean()),
        "friction_low": float(low),
        "friction_high": float(high),
        "precision": float(estimate.precision.mean()),
        **dict.fromkeys(SAMPLED, math.nan),
        **({} if seed is None else sampled(estimate, seed=seed)),
    }


def _responses(
    rig: Rig, signals: Mapping[str, xr.DataArray], friction: float, reference: float
) -> dict[str, Any]:
    """The decay that the estimated friction means from the same release; Coulomb's force and the cell's."""
    decay = fb.simulate(
        system_of(rig),
        friction=friction,
        initial_displacement=rig.release,
        duration=rig.duration,
        sampling_rate=rig.sampling_rate,
        quantity="acceleration",
    )
    force = signals["friction_force"]
    refined = refined_force(rig, force)
    moving = force["time"].values < force.attrs["stop_time"]
    return {
        "estimated": decay.values.tolist(),
        "force": refined.tolist(),
        "coulomb": np.where(moving, reference * np.sign(refined), math.nan).tolist(),
    }


def _rate_pair(record: xr.DataArray, grid: int) -> dict[str, Any]:
    """Prior and posterior of the gamma-exponential pair, Fig. 3."""
    estimate = fb.estimate(record, PAPER_SYSTEM, method="gamma-exponential", prior=RATE_PRIOR)
    prior, posterior = fb.GammaExponential(**RATE_PRIOR).friction, estimate.fit.posterior.friction
    figures: dict[str, Any] = {"rate": [float(posterior.mean()), *posterior.interval(0.9)]}
    ranges: dict[str, tuple[Any, float]] = {"prior": (prior, 22.0), "posterior": (posterior, 22.0)}
    for stage, (distribution, most) in ranges.items():
        axis = np.linspace(0.0, most, 4 * grid)
        figures |= {f"rate_{stage}": axis.tolist(), f"rate_{stage}_pdf": distribution.pdf(axis).tolist()}
    return figures


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimension case; ``sample`` (nan after the end of a shorter record), peaks, and the grids."""
    peaks = results[0]["peaks"]
    n = len(results[0]["prior_friction"]) // len(peaks)
    data: dict[str, Any] = {}

    def table(shape: tuple[int, ...]) -> Callable[[str], Array]:
        def of(name: str) -> Array:
            rows = [np.array(result[name], dtype=np.float64).reshape(shape) for result in results]
            return np.stack(rows)

        return of

    for name in NUMBERS:
        data[name] = (("case", "peaks"), table((len(peaks),))(name))
    for stage in ("prior", "posterior"):
        axes = table((len(peaks), n))
        for name, dim in (
            ("friction", "x"),
            ("precision", "y"),
            ("friction_pdf", "x"),
            ("precision_pdf", "y"),
        ):
            data[f"{stage}_{name}"] = (("case", "peaks", dim), axes(f"{stage}_{name}"))
        data[f"{stage}_density"] = (
            ("case", "peaks", "y", "x"),
            table((len(peaks), n, n))(f"{stage}_density"),
        )
    length = max(len(result["time"]) for result in results)
    for name in ("time", *SERIES):
        padded = np.full((len(results), length), np.nan)
        for row, result in zip(padded, results, strict=True):
            values = np.array(result.get(name, []), dtype=np.float64)
            row[: values.size] = values
        data[name] = (("case", "sample"), padded)
    data["begin"] = ("case", [result.get("begin", math.nan) for result in results])
    example = results[CASES.index("example")]
    for name in ("rate_prior", "rate_prior_pdf", "rate_posterior", "rate_posterior_pdf"):
        data[name] = ("rate_axis", example[name])
    data["rate"] = ("rate_of", example["rate"])
    coordinates = {
        "case": [cell["case"] for cell in cells],
        "peaks": peaks,
        "rate_of": ["mean", "low", "high"],
    }
    return xr.Dataset(data, coords=coordinates, attrs={"synthetic": 1})


def rows(dataset: xr.Dataset) -> list[Row]:
    """The two numbers that every such figure of the paper carries."""
    stated = {
        "example": ("example-estimate", "example-precision"),
        "1": ("estimate-1", "precision-1"),
        "2": ("estimate-2", "precision-2"),
        "2-reduced, 1000 Hz": ("estimate-reduced", "precision-reduced"),
        "2-reduced, 100 Hz": ("estimate-100", "precision-100"),
        "2-reduced, 10 Hz": ("estimate-10", "precision-10"),
    }
    table = []
    for case, (friction, precision) in stated.items():
        for peaks in dataset["peaks"].values.tolist():
            one = dataset.sel(case=case, peaks=peaks)
            table.append(
                Row(
                    f"{case}, {peaks}: friction and precision, prior as drawn",
                    f"{float(one['friction']):.4f} N, {float(one['precision']):.3g} 1/N^2",
                    f"{printed(friction):g} N, {printed(precision):g} 1/N^2",
                    "one record",
                    word(one),
                )
            )
    return table


EXPERIMENT = Experiment(
    name="shown_records",
    question="what do the paper's figures show of single records?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    paired=("case", "run"),
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
