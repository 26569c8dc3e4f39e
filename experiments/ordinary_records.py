"""How does ``estimate`` do by default on the recordings an ordinary laboratory makes?

Records of filters, conversions, fluctuating friction, hands and drives, by a simulator that shares no code
with the package; see :mod:`experiments.ordinary`. :func:`score` prints the table of chosen rows on seeds of
its own, for use while an estimator is changed:

    python -m experiments.ordinary "low pass" --records 9
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from experiments.method_tables import percent_of, share_error
from experiments.ordinary.judged import ESTIMATORS, VERDICT, judged
from experiments.ordinary.recipes import RECIPES
from experiments.ordinary.table import lines_of, short
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out
from experiments.tables import Row, markdown

__all__ = ["EXPERIMENT", "Config", "cells", "score"]

_COMPARED = ("default", "no random force")
_MOST_OFF = 0.1
"""Share of records with the truth a whole interval off, above which a row is named."""
_FACTS = {
    "gain": ("1", "by what the way from sensor to file multiplies the motion"),
    "sensor": ("1", "0 displacement, 1 velocity, 2 acceleration, as it is in the file"),
    "half_cycles": ("1", "recorded"),
    "per_period": ("1", "samples a period"),
    "noise_over_signal": ("1", "standard deviations"),
    "share": ("1", "standard deviation of what fluctuates over friction"),
    "memory": ("1", "correlation time of a random force over the period"),
    "corner": ("1", "of a filter over the motion's frequency"),
    "margin": ("1", "samples that were filtered too and cut off"),
    "level": ("1", "of saturation over the largest signal"),
    "size": ("1", "of the hand over friction, positive where it pulls away from rest"),
    "until": ("1", "periods for which a hand or a drive acts"),
}


@dataclass(frozen=True)
class Config:
    """Records a row: a multiple of three, so that each sensor has as many."""

    records: int = 9
    records_full: int = 54


def cells(config: Config, full: bool) -> list[Cell]:
    """One cell a record."""
    wanted = config.records_full if full else config.records
    return [{"row": row, "replicate": replicate} for replicate in range(wanted) for row in RECIPES]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Draw one record, estimate it by every way, and open the seal."""
    ordinary = RECIPES[cell["row"]](np.random.default_rng(seed), cell["replicate"])
    facts = {
        **ordinary.facts,
        "gain": ordinary.gain,
        "sensor": float(("displacement", "velocity", "acceleration").index(ordinary.quantity)),
    }
    return {**judged(ordinary), **{name: facts.get(name, math.nan) for name in _FACTS}}


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions row, replicate, estimator; what was drawn over row and replicate."""
    dims = ("row", "replicate")
    dataset = lay_out(cells, results, dims=dims, variables=VERDICT, inner={"estimator": ESTIMATORS})
    return dataset.merge(lay_out(cells, results, dims=dims, variables=_FACTS), combine_attrs="override")


def rows(dataset: xr.Dataset) -> list[Row]:
    """Each row by default and without a random force, and which estimator is nearest to the truth."""
    names = dataset["row"].values.tolist()
    return [*(_row(name, dataset.sel(row=name)) for name in names), *_over_all_rows(dataset)]


def _over_all_rows(dataset: xr.Dataset) -> list[Row]:
    """How often each estimate is whole intervals off, and in which rows the default is."""
    off = dataset["off"].mean("replicate")
    default, without = (percent_of(dataset["off"].sel(estimator=label)) for label in _COMPARED)
    worst = off.sel(estimator="default")
    wrong = dataset["row"].values[(worst > _MOST_OFF).values].tolist()
    return [
        Row("a whole interval off, all rows", default, without),
        Row(f"rows with more than {_MOST_OFF:.0%} of that", str(len(wrong)), "", ", ".join(wrong)),
    ]


def _row(name: str, records: xr.Dataset) -> Row:
    answered = [
        label for label in ESTIMATORS if bool(np.isfinite(records["ratio"].sel(estimator=label)).any())
    ]
    if "default" not in answered:
        refused = int(records["refused"].sel(estimator="default").sum())
        return Row(name, f"{refused} of {records.sizes['replicate']} refused")
    default, without = (_words(records, label) for label in _COMPARED)
    return Row(name, default, without, _nearest(records, answered))


def _words(records: xr.Dataset, label: str) -> str:
    own = records.sel(estimator=label)
    if not np.isfinite(own["ratio"]).any():
        return "refused"
    ratio, width = (float(own[name].median()) for name in ("ratio", "width"))
    return f"covers {percent_of(own['covered'])}, {ratio:.3f} of the truth, width {short(100.0 * width)} %"


def _nearest(records: xr.Dataset, labels: Sequence[str]) -> str:
    """Say which estimate has the smallest median error and which covers most."""
    errors = {label: float(abs(records["ratio"].sel(estimator=label) - 1.0).median()) for label in labels}
    covers = {label: share_error(records["covered"].sel(estimator=label))[0] for label in labels}
    nearest, surest = min(errors, key=errors.__getitem__), max(covers, key=covers.__getitem__)
    text = f"nearest: {nearest}, off by {short(100.0 * errors[nearest])} % (median)"
    text += "" if nearest == "default" else f", the default by {short(100.0 * errors['default'])} %"
    text += f"; covers most: {surest}, {100.0 * covers[surest]:.0f} %"
    gain = float(records["gain"].median())
    return text if abs(gain - 1.0) < 5e-4 else f"{text}; the signal itself is {gain:.4f} of the motion's"


def details(dataset: xr.Dataset) -> list[Mapping[str, str]]:
    """One line a row and estimator."""
    return [
        line
        for row in dataset["row"].values.tolist()
        for line in lines_of(row, dataset.sel(row=row), ESTIMATORS)
    ]


def score(
    rows: Sequence[str] | None = None, records: int = 9, *, seed: int = 1, by_sensor: bool = False
) -> xr.Dataset:
    """Print the table of chosen rows, each as soon as it is there, and return what it is made of.

    Parameters
    ----------
    rows : sequence of str, optional
        Beginnings of the names in :data:`experiments.ordinary.recipes.RECIPES`; all when left out.
    records : int
        Of each row.
    seed : int
        Records of another seed are other records; none are those of the experiment.
    by_sensor : bool
        Whether each sensor has lines of its own.
    """
    chosen = [name for name in RECIPES if rows is None or any(name.startswith(each) for each in rows)]
    if not chosen:
        raise ValueError(f"no row begins with any of {rows}: give some of {', '.join(RECIPES)}")
    found = []
    for i, name in enumerate(chosen):
        of_row = [{"row": name, "replicate": replicate} for replicate in range(records)]
        entropy = [seed, zlib.crc32(name.encode())]
        sequences = np.random.SeedSequence(entropy).spawn(records)
        results = [run(Config(), cell, each) for cell, each in zip(of_row, sequences, strict=True)]
        dataset = assemble(of_row, results)
        lines = lines_of(name, dataset.sel(row=name), ESTIMATORS)
        if by_sensor:
            lines = _lines_by_sensor(name, dataset.sel(row=name))
        text = markdown(lines)
        # the heading once
        print(text if i == 0 else text.split("\n", 2)[2], end="", flush=True)
        found.append(dataset)
    return xr.concat(found, dim="row")


def _lines_by_sensor(name: str, records: xr.Dataset) -> list[Mapping[str, str]]:
    return [
        line
        for i, sensor in enumerate(("displacement", "velocity", "acceleration"))
        if bool((records["sensor"] == i).any())
        for line in lines_of(
            f"{name}, {sensor}", records.isel(replicate=(records["sensor"] == i).values), ESTIMATORS
        )
    ]


EXPERIMENT = Experiment(
    name="ordinary_records",
    question="how does estimate do by default on the recordings an ordinary laboratory makes?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    details=details,
    heading="no random force",
    group="own",
)

if __name__ == "__main__":
    main(EXPERIMENT)
