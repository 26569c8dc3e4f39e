"""How robust are the closed forms to noise? The example of section 3 at many signal-to-noise ratios."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

from experiments.against_emcee import verdict_rows, word
from experiments.against_paper import band, compared, detail_rows
from experiments.closed_forms import METHODS, measure
from experiments.cramer_rao import bound_row, paper_decay
from experiments.joint_evidence import together
from experiments.method_tables import with_error
from experiments.paper_numbers import printed
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import SweepConfig, gather, seeds_of, sweep_cells
from experiments.tables import Row
from friction_bayes.mechanics.simulate import noise_sd_for, signal_to_noise_db
from friction_bayes.mechanics.testbed import PAPER_RELEASE, PAPER_SYSTEM, paper_example

__all__ = ["EXPERIMENT", "Config", "noise_for"]

FRICTION = printed("example-friction")
"""True friction of the example [N]."""

LEVELS = {"snr_db": "dB"}


@dataclass(frozen=True)
class Config(SweepConfig):
    """Signal-to-noise ratios [dB], and the noise that the paper states [m], which is one more level.

    The gamma-exponential pair has an experiment of its own.
    """

    snr_db: tuple[float, ...] = (30.0, 25.0, 20.0, 17.0, 14.7, 12.0, 8.6, 6.0, 3.0)
    stated_noise_sd: float = printed("example-noise")
    methods: tuple[str, ...] = tuple(method for method in METHODS if method != "gamma-exponential")


PAPER_ERRORS = {
    printed("example-snr"): printed("example-error"),
    printed("noise-snr-14.7"): printed("noise-error-14.7"),
    printed("noise-snr-8.6"): printed("noise-error-8.6"),
}
"""Error of the friction [%] by stated signal-to-noise ratio [dB], section 3."""

PAPER_FRICTION, PAPER_PRECISION = printed("example-estimate"), printed("example-precision")
PAPER_RMSE = printed("example-rmse")
"""Estimates [N], [1/N^2] and residual [m] of the record that section 3 shows, stated as 20 dB and 5e-4 m."""


@cache
def _clean() -> np.ndarray:
    """Noise-free displacement while the system moves [m]."""
    record = paper_example(0, noise_sd=0.0)
    return record.values[record["time"].values < record.attrs.get("stop_time", math.inf)]


def noise_for(snr_db: float) -> float:
    """Noise of a sample [m] at which the example has a signal-to-noise ratio [dB]."""
    return noise_sd_for(_clean(), snr_db)


def noise_of(level: float, config: Config) -> float:
    """Noise of a sample [m] at a level: the very one that the paper states at its own."""
    return config.stated_noise_sd if level == stated_level(config) else noise_for(level)


def stated_level(config: Config) -> float:
    """Signal-to-noise ratio of the noise that the paper states [dB], by this project's definition."""
    return round(signal_to_noise_db(_clean(), config.stated_noise_sd), 2)


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every level, the stated noise's own among them."""
    stated = stated_level(config)
    levels = sorted({*config.snr_db, stated}, reverse=True)
    of_paper = {stated, *PAPER_ERRORS}
    return sweep_cells({"snr_db": levels}, config, full, of_paper=lambda known: known["snr_db"] in of_paper)


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Run ``i`` has one draw of noise at every level, scaled, which is that of the example elsewhere."""
    of_noise, of_sampler = seeds_of(cell, seed)
    record = paper_example(of_noise, noise_sd=noise_of(cell["snr_db"], config))
    return measure(
        record, PAPER_SYSTEM, FRICTION, methods=config.methods, check=cell["check"], seed=of_sampler
    )


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """Dimensions snr_db, replicate, method; with the noise of each level and the Cramer-Rao bound at it."""
    dataset = gather(cells, results, levels=LEVELS)
    noise = np.array([noise_of(level, Config()) for level in dataset["snr_db"].values.tolist()])
    # the error of the efficient estimator that is linear in the noise, all five parameters unknown
    bound = PAPER_SYSTEM.stiffness * float(np.linalg.norm(bound_row(paper_decay(0), PAPER_RELEASE)))
    bounds = noise * bound / FRICTION
    return dataset.assign(
        level_noise_sd=("snr_db", noise, {"units": "m", "long_name": "noise of a sample"}),
        bound=("snr_db", bounds, {"units": "1", "long_name": "Cramer-Rao bound of the error"}),
    )


def _error_rows(at_level: xr.Dataset, name: str, paper_error: float) -> list[Row]:
    """Size of the error by every method that estimates friction, and the paper's."""
    rows = []
    for method in at_level["method"].values.tolist():
        mine = at_level.sel({"method": method})
        checked = word(mine)
        what = f"{name}: |error|, {method}"
        if method.startswith("normal-gamma"):
            row = compared(what, abs(mine["error"]), paper_error, unit="%", factor=100.0, sampler=checked)
            closer = int((100.0 * abs(mine["error"]) <= paper_error).sum())
            rows.append(
                replace(
                    row, remark=f"{row.remark}; {closer} of {int(mine['error'].notnull().sum())} as close"
                )
            )
        else:
            ours = f"{band(abs(mine['error']), factor=100.0)} %"
            rows.append(Row(what, ours, f"{paper_error:g} %", "not the paper's method", checked))
    return rows


def _shown_record_rows(at_level: xr.Dataset, name: str) -> list[Row]:
    """What section 3 states about the one record it shows."""
    rows = []
    methods = at_level["method"].values.tolist()
    for method in (label for label in methods if label.startswith("normal-gamma")):
        mine = at_level.sel({"method": method})
        what, checked = f"{name}: friction, {method}", word(mine)
        rows.append(compared(what, mine["friction"], PAPER_FRICTION, unit="N", sampler=checked))
        rows.append(
            compared(f"{name}: precision, {method}", mine["precision"], PAPER_PRECISION, unit="1/N^2")
        )
        rows.append(
            Row(
                f"{name}: 1/sqrt(precision), {method}",
                f"{band(mine['precision'] ** -0.5)} N",
                "8.4e-4",
                f"1/sqrt({PAPER_PRECISION:g}) is {PAPER_PRECISION**-0.5:.3f} N: theirs does not follow",
            )
        )
    if "waveform" in methods:
        noise = at_level.sel({"method": "waveform"})["noise_sd"]
        rows.append(compared(f"{name}: noise of a sample, waveform", noise, PAPER_RMSE, unit="m"))
        error = at_level["error"].sel({"method": "waveform"}).dropna("replicate")
        ratio = float(np.sqrt((error**2).mean()) / at_level["bound"])
        rows.append(
            Row(
                f"{name}: RMS error over the Cramer-Rao bound, waveform",
                with_error(ratio, ratio / math.sqrt(2.0 * error.size)),
                "",
                "by all parameters unknown; every level has the same draws, and so the same chance",
            )
        )
    return rows


def _joint_rows(dataset: xr.Dataset) -> list[Row]:
    """How often three records are as good as the paper's three errors, all of them."""
    stated = dict(zip([stated_level(Config()), *list(PAPER_ERRORS)[1:]], PAPER_ERRORS.values(), strict=True))
    if not set(stated) <= set(dataset["snr_db"].values.tolist()):
        return []
    taken = dataset.sel(snr_db=list(stated))
    picked = [label for label in taken["method"].values.tolist() if label.startswith("normal-gamma")]
    found = {label: taken["error"].sel({"method": label}) for label in taken["method"].values.tolist()}
    found |= {
        label.replace("normal-gamma", "straight line"): taken["line_error"].sel({"method": label})
        for label in picked
    }
    table = []
    for label, error in found.items():
        sizes = 100.0 * abs(error).transpose("snr_db", "replicate").values
        joint = together(sizes, list(stated.values()))
        rms = ", ".join(f"{each:.2g}" for each in np.sqrt(np.nanmean(sizes**2, axis=1)))
        paper = ", ".join(f"{each:g}" for each in stated.values()) + " %"
        name = f"three errors, {label}"
        product = with_error(joint.product, joint.product * joint.relative_error)
        table += [
            Row(
                f"{name}: records as close",
                ", ".join(f"{each:.2g}" for each in joint.shares),
                paper,
                f"RMS {rms} %",
            ),
            Row(f"{name}: all three, if independent", product, paper),
            Row(
                f"{name}: Fisher's combined test",
                with_error(joint.fisher, joint.fisher_error),
                paper,
                "chance of three errors as improbably small together",
            ),
        ]
    return table


def rows(dataset: xr.Dataset) -> list[Row]:
    """The paper's three levels, and its one record at the ratio and at the noise that it states."""
    table: list[Row] = []
    levels = dataset["snr_db"].values.tolist()
    stated = stated_level(Config())
    for level in levels:
        name = f"{level:.4g} dB" + (" (noise 5e-4 m)" if level == stated else "")
        at_level = dataset.sel(snr_db=level)
        if level in PAPER_ERRORS:
            table += _error_rows(at_level, name, PAPER_ERRORS[level])
        if level in (20.0, stated):
            table += _shown_record_rows(at_level, name)
    return table + _joint_rows(dataset) + verdict_rows(dataset)


EXPERIMENT = Experiment(
    name="noise_sweep",
    question="how robust are the closed forms to noise?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    paired=("snr_db",),
    common_records=True,
    details=lambda dataset: detail_rows(dataset, tuple(LEVELS)),
)

if __name__ == "__main__":
    main(EXPERIMENT)
