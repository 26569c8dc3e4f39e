"""Would the settings of the loop be others if the set-up that is scored had no say in them?"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from experiments import loop_measured
from experiments.loop_settings import using
from experiments.runner import Cell, Experiment, Row, main
from friction_bayes.core.text import number, percent
from friction_bayes.loop import settings
from friction_bayes.records.datasets import DATASETS

__all__ = ["EXPERIMENT", "Config", "assemble", "cells", "chosen", "log_ratios", "rows"]

_AS_THEY_ARE = "as they are"
_FACTORS = {0.5: "halved", 2.0: "doubled"}
NUMBERS = {
    "held_out_before": "RMS error over the last 30 % of the Coulomb model alone, fitted to the first 70 %",
    "held_out_after": "the same of the final model",
    "inside90": "share of the held-out samples in the predictive 90 % band",
    "friction_after": "posterior mean over the candidates",
    "friction_after_sd": "its standard deviation",
    "processor": "processor time, with what a worker loads for its first record [s]",
}
TEXTS = ("verdict", "refused")


@dataclass(frozen=True)
class Config:
    """Most records of a set-up, what is varied, and how often the settings as they are have another seed.

    Varied are judgements that move friction, its interval or a forecast the most.
    """

    records: int = 4
    settings: tuple[str, ...] = (
        "force_share",
        "no_dry_friction",
        "nuisance",
        "friction_share",
        "minor_share",
        "unseen",
    )
    other_seeds: int = 2


def _spread(names: Sequence[str], most: int) -> list[str]:
    """Some of the records of a set-up, evenly over all: of two kinds that follow each other both."""
    places = np.linspace(0, len(names) - 1, min(most, len(names))).round().astype(int)
    return [names[i] for i in places]


def cells(config: Config, full: bool) -> list[Cell]:
    """Every variant on every record; ``full`` changes nothing."""
    del full
    records = [
        f"{name}/{part}"
        for name, data_set in DATASETS.items()
        for part in _spread(list(data_set.parts), config.records)
    ]
    varied = [(name, factor, 0) for name in config.settings for factor in _FACTORS]
    again = [("", 1.0, k) for k in range(1, config.other_seeds + 1)]
    return [
        {"record": record, "setting": setting, "factor": factor, "again": k}
        for record in records
        for setting, factor, k in [("", 1.0, 0), *varied, *again]
    ]


def _with_setting(setting: str, factor: float) -> AbstractContextManager[None]:
    return using(setting, factor) if setting else nullcontext()


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Close the loop on one record as ``loop_measured`` does, with one setting varied."""
    del config
    measured = loop_measured.EXPERIMENT
    with _with_setting(cell["setting"], cell["factor"]):
        fields = measured.run(measured.config, {"record": cell["record"]}, seed)
    return {name: fields[name] for name in (*NUMBERS, *TEXTS)}


def _label(cell: Cell) -> str:
    if cell["again"]:
        return f"{_AS_THEY_ARE}, another seed ({cell['again']})"
    return f"{cell['setting']} {_FACTORS[cell['factor']]}" if cell["setting"] else _AS_THEY_ARE


def _value(cell: Cell) -> float:
    """Value of the setting that is varied; nan where none is."""
    with _with_setting(cell["setting"], cell["factor"]):
        return float(getattr(settings.SETTINGS, cell["setting"])) if cell["setting"] else math.nan


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """Over record and variant."""
    records = list(dict.fromkeys(str(cell["record"]) for cell in cells))
    variants = {_label(cell): cell for cell in cells}
    both, shape = ("record", "variant"), (len(records), len(variants))
    dataset = xr.Dataset(
        coords={
            "record": records,
            "set_up": ("record", [record.split("/")[0] for record in records]),
            "variant": list(variants),
            "again": ("variant", [int(cell["again"]) for cell in variants.values()]),
            "value": ("variant", [_value(cell) for cell in variants.values()]),
        }
    )
    for name, meaning in NUMBERS.items():
        column = np.array([result[name] for result in results], dtype=np.float64)
        dataset[name] = (both, column.reshape(shape), {"long_name": meaning})
    for name in TEXTS:
        dataset[name] = (both, np.array([str(result[name]) for result in results]).reshape(shape))
    dataset["log_ratio"] = (both, np.log((dataset["held_out_after"] / dataset["held_out_before"]).values))
    return dataset


def log_ratios(dataset: xr.Dataset) -> xr.DataArray:
    """Return the log of the held-out error after over before, mean over the records of a set-up.

    A record that cannot be forecast with one of the variants is left out of all, so that every variant is
    scored on the same records.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`assemble`.

    Returns
    -------
    xarray.DataArray
        Over set_up and variant; nan where no record is left.
    """
    return _by_set_up(dataset, dataset["log_ratio"].where(_forecast(dataset)))


def _forecast(dataset: xr.Dataset) -> xr.DataArray:
    """Whether every variant forecasts a record."""
    return dataset["log_ratio"].notnull().all("variant")


def _by_set_up(dataset: xr.Dataset, values: xr.DataArray) -> xr.DataArray:
    """Means over the records of each set-up, in the order of the records."""
    names = list(dict.fromkeys(dataset["set_up"].values.tolist()))
    return values.groupby("set_up").mean("record").sel(set_up=names)


def chosen(scores: xr.DataArray) -> dict[str, str]:
    """Return for each set-up the variant that scores best on all others.

    Parameters
    ----------
    scores : xarray.DataArray
        Of :func:`log_ratios`; of variants that score the same, or nothing, the first is chosen.

    Returns
    -------
    dict of str to str
        Variant by set-up.
    """
    found = {}
    for name in scores["set_up"].values.tolist():
        others = scores.drop_sel(set_up=name).mean("set_up").fillna(np.inf)
        found[name] = str(others["variant"][int(others.argmin("variant"))].item())
    return found


@dataclass(frozen=True)
class _Score:
    """Of one variant: error after over before, records that are unexplained, and share in the band."""

    log_ratio: float
    unexplained: int
    records: int
    inside: float

    @property
    def ratio(self) -> str:
        return number(math.exp(self.log_ratio), 3) if math.isfinite(self.log_ratio) else "no forecast"

    @property
    def left(self) -> str:
        return f"{self.unexplained} of {self.records}"

    @property
    def band(self) -> str:
        return percent(self.inside) if math.isfinite(self.inside) else "nothing"

    def __str__(self) -> str:
        return f"{self.ratio}; {self.left} unexplained; {self.band} in the band"


def _scored(dataset: xr.Dataset, variants: Mapping[str, str]) -> _Score:
    """Set-ups together, each with its own variant."""
    scores, inside = log_ratios(dataset), _by_set_up(dataset, dataset["inside90"])
    unexplained = (dataset["verdict"] == "unexplained").groupby("set_up").sum("record")
    each = [{"set_up": name, "variant": variant} for name, variant in variants.items()]
    return _Score(
        log_ratio=_mean([float(scores.sel(one)) for one in each]),
        unexplained=sum(int(unexplained.sel(one)) for one in each),
        records=int(dataset["set_up"].isin(list(variants)).sum()),
        inside=_mean([float(inside.sel(one)) for one in each]),
    )


def _mean(values: Sequence[float]) -> float:
    """Mean of those that are known."""
    known = [value for value in values if math.isfinite(value)]
    return math.fsum(known) / len(known) if known else math.nan


def rows(dataset: xr.Dataset) -> list[Row]:
    """Each set-up with the settings that the others choose, all together, and what chance alone does."""
    choices = chosen(log_ratios(dataset).isel(variant=dataset["again"].values == 0))
    as_they_are = dict.fromkeys(choices, _AS_THEY_ARE)
    lines = []
    for name, variant in choices.items():
        ours, usual = _scored(dataset, {name: variant}), _scored(dataset, {name: _AS_THEY_ARE})
        remark = f"the others choose: {variant}"
        lines.append(Row(f"{name}, {_count(ours.records)}", str(ours), str(usual), remark))
    kept = sum(variant == _AS_THEY_ARE for variant in choices.values())
    ours, usual = _scored(dataset, choices), _scored(dataset, as_they_are)
    left = int((~_forecast(dataset)).sum())
    remark = f"settings as they are chosen for {kept} of {len(choices)}; {_count(left)} without a forecast"
    lines.append(Row(f"all set-ups, {_count(ours.records)}", str(ours), str(usual), remark))
    for again in dataset["variant"].values[dataset["again"].values > 0].tolist():
        chance = _scored(dataset, dict.fromkeys(choices, again))
        lines.append(Row(f"all set-ups, {again}", str(chance), str(usual), "what chance alone does"))
    return lines


def _count(records: int) -> str:
    return f"{records} record{'' if records == 1 else 's'}"


def details(dataset: xr.Dataset) -> list[dict[str, str]]:
    """Every variant on all set-ups, the settings as they are first."""
    scores = log_ratios(dataset)
    usual = dataset.sel(variant=_AS_THEY_ARE)
    lines = []
    for variant in dataset["variant"].values.tolist():
        own = dataset.sel(variant=variant)
        score = _scored(dataset, dict.fromkeys(scores["set_up"].values.tolist(), variant))
        moved = np.abs(own["friction_after"] - usual["friction_after"]) / usual["friction_after_sd"]
        lines.append(
            {
                "variant": variant,
                "value": number(float(own["value"]), 3) if np.isfinite(own["value"]) else "",
                "error after / before": score.ratio,
                "over that as they are": _change(scores, variant),
                "unexplained": score.left,
                "in the 90 % band": score.band,
                "without a forecast": str(int(np.isnan(own["log_ratio"]).sum())),
                "other verdicts": str(int((own["verdict"] != usual["verdict"]).sum())),
                "friction moves by at most": f"{float(moved.max()):.2g} sd",
                "processor time": f"{float(own['processor'].sum()):.0f} s",
            }
        )
    return lines


def _change(scores: xr.DataArray, variant: str) -> str:
    """Change of the error with a variant, its standard error over set-ups, and in how many it is smaller."""
    if variant == _AS_THEY_ARE:
        return ""
    change = (scores.sel(variant=variant) - scores.sel(variant=_AS_THEY_ARE)).dropna("set_up").values
    if change.size < 2:
        return "too few set-ups"
    mean, error = math.expm1(change.mean()), change.std(ddof=1) / math.sqrt(change.size)
    smaller, larger = int((change < 0.0).sum()), int((change > 0.0).sum())
    return f"{100.0 * mean:+.1f} ± {100.0 * error:.1f} %, smaller in {smaller}, larger in {larger}"


EXPERIMENT = Experiment(
    name="loop_left_out",
    question="would the settings of the loop be others if the set-up that is scored had no say in them?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="with the settings as they are",
    group="measured",
    paired=("setting", "factor"),
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
