"""How does the loop do on the recordings an ordinary laboratory makes?

The records of :mod:`experiments.ordinary_records`, of other seeds: a simulator that shares no code with the
package filters, differentiates, resamples and disturbs them. But for those that something else resists, none
has an effect of the catalogue in it, so that every law but dry friction, with a random force where friction
fluctuates, is an imitation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from time import process_time
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

import friction_bayes as fb
from experiments.blind.scoring import widths_off
from experiments.method_tables import percent_of
from experiments.ordinary.recipes import RECIPES
from experiments.ordinary.resisted_records import RESISTED
from experiments.ordinary_records import Config, cells
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out
from experiments.tables import Row
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.records.record import make_record

__all__ = ["EXPERIMENT"]

_NUMBERS = {
    "refused": ("1", "whether the record was refused"),
    "ratio": ("1", "mean of the friction over the true one"),
    "width": ("1", "width of the 90 % interval over the true friction"),
    "covered": ("1", "whether the interval covers the true friction"),
    "off": ("1", "whether the mean is more than the whole width of the interval off the truth"),
    "forecast": ("1", "held-out error after over before"),
    "imitation": ("1", "whether the most probable law has an effect besides a random force"),
    "filtered": ("1", "whether a filter was found"),
    "verdict": ("1", "adequate, explained, ambiguous or unexplained, from 0 on"),
    "elapsed": ("s", "processor time"),
}
_VERDICTS = ("adequate", "explained", "ambiguous", "unexplained")
_SURPRISING = 0.01
"""Probability of as many misses or more under a coverage of 90 %, below which a row is named."""


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Draw one record, close the loop on it and its system alone, and open the seal."""
    seed_of_record, seed_of_loop = seed.spawn(2)
    ordinary = RECIPES[cell["row"]](np.random.default_rng(seed_of_record), cell["replicate"])
    record = make_record(
        ordinary.times, ordinary.values, ordinary.quantity, name="ordinary record", synthetic=True
    )
    system = fb.Oscillator(mass=ordinary.mass, stiffness=ordinary.stiffness)
    began, known = process_time(), dict.fromkeys(_NUMBERS, math.nan)
    try:
        report = fb.close_loop(record, system, seed=int(seed_of_loop.generate_state(1)[0])).to_dict()
    except fb.InputError:
        return known | {"refused": 1.0, "elapsed": process_time() - began}
    error, effects = report["held_out_error"], report["candidates"][0]["effects"]
    known |= {
        "refused": 0.0,
        "forecast": error["after"] / error["before"] if error["after"] and error["before"] else math.nan,
        "imitation": float(bool(set(effects) - {RANDOM_FORCE.name})),
        "filtered": float(report["noise"]["filter"] is not None),
        "elapsed": process_time() - began,
        "verdict": float(_VERDICTS.index(report["verdict"])),
    }
    if ordinary.truth is None:
        return known
    fitted, after = report["fitted"], report["friction_after"]
    truth = ordinary.truth(fitted["from_s"], fitted["to_s"])
    low, high = after["interval90"]
    return known | {
        "ratio": after["mean"] / truth,
        "width": (high - low) / truth,
        "covered": float(low <= truth <= high),
        "off": float(widths_off(after, truth) > 1.0),
    }


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions row and replicate."""
    return lay_out(cells, results, dims=("row", "replicate"), variables=_NUMBERS)


def rows(dataset: xr.Dataset) -> list[Row]:
    """All records that were not refused, and the rows in which too few are covered."""
    answered = dataset["refused"] == 0.0
    covered = dataset["covered"].where(answered)
    fewer = ", ".join(
        str(name) for name in dataset["row"].values if _too_few(covered.sel(row=name)) < _SURPRISING
    )
    unexplained = (dataset["verdict"] == _VERDICTS.index("unexplained")).where(answered)
    forecast = dataset["forecast"].where(answered)
    resisted = dataset["row"].isin(list(RESISTED))
    imitation = dataset["imitation"].where(answered & ~resisted)
    return [
        Row(
            "90 % intervals that cover the truth",
            percent_of(covered),
            "88 to 92 %",
            f"too few in: {fewer}" if fewer else "",
        ),
        Row("a whole interval off", percent_of(dataset["off"].where(answered)), "0"),
        Row("unexplained", percent_of(unexplained), "", "of the records that were not refused"),
        Row(
            "an effect that is not there",
            percent_of(imitation),
            "",
            "of records that dry friction alone resists",
        ),
        Row(
            "held-out error, after over before",
            f"median {float(forecast.median()):.2f}",
            "",
            f"above 1.05 in {percent_of((forecast > 1.05).where(np.isfinite(forecast)))}",
        ),
        Row("refused", str(int(dataset["refused"].sum())), "", f"of {dataset['refused'].size}"),
    ]


def _too_few(covered: xr.DataArray) -> float:
    answered = covered.dropna("replicate")
    return float(stats.binom.sf(int((answered == 0.0).sum()) - 1, answered.size, 0.1))


def details(dataset: xr.Dataset) -> list[Mapping[str, str]]:
    """One line a row."""
    return [_line(str(name), dataset.sel(row=name)) for name in dataset["row"].values]


def _line(name: str, records: xr.Dataset) -> Mapping[str, str]:
    answered = records.isel(replicate=(records["refused"] == 0.0).values)
    line = {"row": name, "refused": str(int(records["refused"].sum()))}
    words = [_VERDICTS[int(verdict)] for verdict in answered["verdict"].values]
    line |= {verdict: str(words.count(verdict)) for verdict in _VERDICTS}
    named = ("covered", "off", "friction / truth", "width / truth", "forecast", "filter found", "time [s]")
    if not words:
        return line | dict.fromkeys(named, "")
    return line | {
        "covered": f"{int(answered['covered'].sum())} of {len(words)}",
        "off": str(int(answered["off"].sum())),
        "friction / truth": f"{float(answered['ratio'].median()):.4f}",
        "width / truth": f"{float(answered['width'].median()):.3g}",
        "forecast": f"{float(answered['forecast'].median()):.2f}",
        "filter found": str(int(answered["filtered"].sum())),
        "time [s]": f"{float(answered['elapsed'].median()):.1f}",
    }


EXPERIMENT = Experiment(
    name="loop_ordinary",
    question="how does the loop do on the recordings an ordinary laboratory makes?",
    config=Config(records=6),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    details=details,
    heading="target",
    group="own",
)

if __name__ == "__main__":
    main(EXPERIMENT)
