"""What hangs on each number that decides in a closed loop? Each is doubled and halved on a small corpus."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import Field, dataclass, fields, replace
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import expit, logit

import friction_bayes as fb
from experiments.blind.fluctuating import draw_fluctuating
from experiments.blind.misleading_records import MISLEADING, draw_misleading
from experiments.blind.near_threshold import draw_near_threshold
from experiments.runner import Cell, Experiment, Row, main
from friction_bayes.core.text import number
from friction_bayes.loop import settings
from friction_bayes.records.datasets import LOCAL_FOLDER

__all__ = ["EXPERIMENT", "using"]

_FIELDS = {each.name: each for each in fields(settings.LoopSettings)}
_AS_IT_IS = ""
"""Name of the setting of the cell in which none is varied."""
_FACTORS = {0.5: "halved", 2.0: "doubled"}
_SMALL = ("plain_coulomb", "one_sided_stop", "shared_error", "differing_releases")
"""Of one rig, whose effect is small or imitates another; a pair of records among them."""
_FLUCTUATING = ("plain_coulomb", "outliers")
_STEADY = ("sensor_clipping", "disturbed_release", "periodic_interference", "quadratic_drag")
"""Of any rig, with a random force and without."""
_MEASURED = ("bicycle-wheel/1", "pasco-oscillator/no-magnet-2")

Release = tuple[Sequence[xr.DataArray], fb.Oscillator]


@dataclass(frozen=True)
class Config:
    """Seed of the corpus, and the size that its records are cut to."""

    seed: int = 7
    samples: int = 1000
    samples_a_period: float = 40.0


def cells(config: Config, full: bool) -> list[Cell]:
    """One cell for the settings as they are, and two for each of them; ``full`` changes nothing."""
    del config, full
    measured = LOCAL_FOLDER in os.environ
    varied = [(name, factor) for name in _FIELDS for factor in _FACTORS]
    return [
        {"setting": name, "factor": factor, "measured": measured}
        for name, factor in [(_AS_IT_IS, 1.0), *varied]
    ]


def _varied(field: Field[Any], factor: float) -> Any:
    """A setting doubled or halved: the odds of probabilities and shares, counts rounded."""
    value = field.default
    if isinstance(value, tuple):
        return tuple(factor * each for each in value)
    if field.metadata["unit"] in ("probability", "share"):
        return float(expit(logit(value) + math.log(factor)))
    return type(value)(round(factor * value)) if isinstance(value, int) else factor * value


@contextmanager
def using(setting: str, factor: float) -> Iterator[None]:
    """Close loops with one setting varied."""
    before = settings.SETTINGS
    if setting != _AS_IT_IS:
        settings.SETTINGS = replace(before, **{setting: _varied(_FIELDS[setting], factor)})
    try:
        yield
    finally:
        settings.SETTINGS = before


def _corpus(config: Config, measured: bool) -> Iterator[Release]:
    """Short records of different kinds, synthetic ones and, where they are at hand, measured ones."""
    for kind in _SMALL:
        draw = draw_misleading if kind in MISLEADING else draw_near_threshold
        small = draw(kind, config.seed)
        yield [record[::3] for record in small.records], fb.Oscillator(**small.declared)
    for kind, force in [*((kind, True) for kind in _FLUCTUATING), *((kind, False) for kind in _STEADY)]:
        sealed = draw_fluctuating(kind, config.seed, with_force=force)
        every = max(int(sealed.truth.samples_per_period / config.samples_a_period), 1)
        yield [sealed.record[::every][: config.samples]], fb.Oscillator(**sealed.system)
    for name in _MEASURED if measured else ():
        record, system = fb.dataset_record(name)
        yield [record], system


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Close the loop on the corpus: verdicts and friction, of each record in a list."""
    seed_of_loop = int(seed.generate_state(1)[0])
    found: dict[str, list[Any]] = {"verdict": [], "mean": [], "sd": [], "width": []}
    with using(cell["setting"], cell["factor"]):
        for records, system in _corpus(config, cell["measured"]):
            verdict, friction = _closed(records, system, seed_of_loop)
            low, high = friction["interval90"]
            numbers = {"mean": friction["mean"], "sd": friction["sd"], "width": high - low}
            for name, value in ({"verdict": verdict} | numbers).items():
                found[name].append(value)
    return found


def _closed(
    records: Sequence[xr.DataArray], system: fb.Oscillator, seed: int
) -> tuple[str, Mapping[str, Any]]:
    """Verdict and friction; no friction where the record is refused."""
    try:
        # the default of an option is read once, when the function is defined
        report = fb.close_loop(records, system, seed=seed, tolerance=settings.SETTINGS.tolerance)
    except fb.InputError:
        return "refused", {"mean": math.nan, "sd": math.nan, "interval90": (math.nan, math.nan)}
    return report.verdict, report.friction_after


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """Every variation on every record, in addition to its setting."""
    columns = {name: ("cell", [cell[name] for cell in cells]) for name in ("setting", "factor")}
    measured = {
        # JSON has no number that is not one
        name: (
            ("cell", "record"),
            [[math.nan if v is None else v for v in result[name]] for result in results],
        )
        for name in results[0]
    }
    return xr.Dataset(columns | measured)


@dataclass(frozen=True)
class _Move:
    """What one variation does: verdicts that change, the largest shift of friction [sd], and of a width."""

    verdicts: int
    shift: float
    width: float

    @classmethod
    def of(cls, varied: xr.Dataset, default: xr.Dataset) -> _Move:
        # a record that is refused has no friction
        shift = np.nan_to_num(np.abs(varied["mean"] - default["mean"]) / default["sd"])
        width = np.nan_to_num(np.abs(varied["width"] / default["width"] - 1.0))
        changed = int((varied["verdict"] != default["verdict"]).sum())
        return cls(changed, float(np.max(shift)), float(np.max(width)))

    @property
    def nothing(self) -> bool:
        return self == _Move(0, 0.0, 0.0)

    def __str__(self) -> str:
        if self.nothing:
            return "nothing"
        return f"{self.verdicts} verdicts, {self.shift:.2g} sd, {100.0 * self.width:.2g} %"


def _moves(dataset: xr.Dataset) -> dict[str, dict[float, _Move]]:
    """Of each setting what halving and doubling do."""
    (default,) = np.flatnonzero(dataset["setting"] == _AS_IT_IS)
    found: dict[str, dict[float, _Move]] = {}
    for i, (name, factor) in enumerate(zip(dataset["setting"].values, dataset["factor"].values, strict=True)):
        if i != default:
            move = _Move.of(dataset.isel(cell=i), dataset.isel(cell=default))
            found.setdefault(str(name), {})[float(factor)] = move
    return found


def _shown(value: Any) -> str:
    return " to ".join(map(_shown, value)) if isinstance(value, tuple) else number(value, 3)


def rows(dataset: xr.Dataset) -> list[Row]:
    """How many settings there are, how many move nothing, and the most that one moves."""
    moves = _moves(dataset)
    each = [move for both in moves.values() for move in both.values()]
    still = [name for name, both in moves.items() if all(move.nothing for move in both.values())]
    records = dataset.sizes["record"]
    changed = sum(move.verdicts > 0 for move in each)
    return [
        Row("settings", str(len(moves)), "at most 40"),
        Row("that move nothing", str(len(still)), "0", ", ".join(still)),
        Row("variations that change a verdict", f"{changed} of {len(each)}", "", f"{records} records"),
        Row("that move friction by more than one sd", f"{sum(move.shift > 1.0 for move in each)}", ""),
        Row("that change a width by more than a half", f"{sum(move.width > 0.5 for move in each)}", ""),
    ]


def details(dataset: xr.Dataset) -> list[dict[str, str]]:
    """Every setting with its meaning, unit and source, and what moves with it."""
    return [
        {
            "setting": f"`{name}`",
            "value": _shown(_FIELDS[name].default),
            "unit": _FIELDS[name].metadata["unit"],
            "meaning": _FIELDS[name].metadata["meaning"],
            "source": _FIELDS[name].metadata["source"],
        }
        | {word: str(both[factor]) for factor, word in _FACTORS.items()}
        for name, both in _moves(dataset).items()
    ]


EXPERIMENT = Experiment(
    name="loop_settings",
    question="what hangs on each number that decides in a closed loop?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    beside="target",
    group="own",
    paired=("setting", "factor", "measured"),
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
