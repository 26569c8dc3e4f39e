"""What depends on each number that decides in a closed loop? Each is doubled and halved on a small corpus."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import Field, dataclass, fields, replace
from functools import cache
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import expit, logit

import friction_bayes as fb
from experiments.blind.fluctuating import draw_fluctuating
from experiments.blind.misleading_records import MISLEADING, draw_misleading
from experiments.blind.near_threshold import (
    AMPLITUDE,
    DISSIPATION,
    DURATION,
    FREQUENCY,
    NOISE,
    SAMPLING_RATE,
    SYSTEM,
    ImitatingEffect,
    draw_near_threshold,
    sampled,
)
from experiments.runner import Cell, Experiment, Row, main
from friction_bayes.core.files import settings_key
from friction_bayes.core.text import number
from friction_bayes.loop import settings
from friction_bayes.records.datasets import LOCAL_FOLDER

__all__ = ["EXPERIMENT", "using"]

_AS_THEY_ARE = settings.SETTINGS
_FIELDS = {each.name: each for each in fields(settings.LoopSettings)}
_AS_IT_IS = ""
"""Name of the setting of the cell in which none is varied."""
_FACTORS = {0.5: "halved", 2.0: "doubled"}
_ONE_RIG = {"plain_coulomb": 1, "accelerometer": 1, "shared_error": 7, "differing_releases": 7}
"""Seeds by kind, of one rig, a pair of records among them: the effect is small or imitates another."""
_EVERY_THIRD = 3
"""Sample of a displacement that is kept; of an acceleration all, which the loop averages."""
_FLUCTUATING = {"plain_coulomb": 1, "outliers": 2}
_STEADY = {"sensor_clipping": 1, "disturbed_release": 2, "periodic_interference": 7, "quadratic_drag": 2}
"""Seeds by kind, of any rig, with a random force and without."""
_EFFECTS = (
    "viscous_damping",
    "quadratic_drag",
    "asymmetric_friction",
    "friction_drift",
    "cubic_stiffness",
    "presliding",
    "random_force",
    "sensor_offset",
    "sensor_clipping",
    "periodic_interference",
    "outliers",
)
"""Evaluated for synthetic records: those of the corpus and rivals, in half the time of all."""
_MEASURED = ("bicycle-wheel/1", "map-single-pendulum/small-swing", "pasco-oscillator/no-magnet-4")
"""One with a correlated error of its sensor, one that narrowly fails its forecast band."""

Loop = tuple[Sequence[xr.DataArray], fb.Oscillator, Sequence[str] | None]
"""Records, their system, and the effects to evaluate."""


@dataclass(frozen=True)
class Config:
    """Most samples of a record of any rig."""

    samples: int = 1000


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
def _in_place(other: Any) -> Iterator[None]:
    """Close loops with other settings."""
    settings.SETTINGS = other
    try:
        yield
    finally:
        settings.SETTINGS = _AS_THEY_ARE


def using(setting: str, factor: float) -> AbstractContextManager[None]:
    """Close loops with one setting varied."""
    return _in_place(replace(_AS_THEY_ARE, **{setting: _varied(_FIELDS[setting], factor)}))


def _corpus(samples: int, measured: bool) -> Iterator[Loop]:
    """Short records of different kinds, synthetic ones and, where they are at hand, measured ones."""
    for kind, seed in _ONE_RIG.items():
        small = (draw_misleading if kind in MISLEADING else draw_near_threshold)(kind, seed)
        every = 1 if kind == "accelerometer" else _EVERY_THIRD
        yield [record[::every] for record in small.records], fb.Oscillator(**small.declared), _EFFECTS
    yield [_knocked()], fb.Oscillator(**SYSTEM), _EFFECTS
    for kinds, force in ((_FLUCTUATING, True), (_STEADY, False)):
        for kind, seed in kinds.items():
            sealed = draw_fluctuating(kind, seed, with_force=force)
            every = math.ceil(sealed.record.size / samples)
            yield [sealed.record[::every]], fb.Oscillator(**sealed.system), _EFFECTS
    for name in _MEASURED if measured else ():
        record, system = fb.dataset_record(name)
        yield [record], system, None


def _knocked() -> xr.DataArray:
    """Half a record of the same rig and a tenth of its noise, with a knock of 15 times the friction."""
    touch = (15.0 * DISSIPATION, 0.2 * DURATION * FREQUENCY, 1.0)
    clean = AMPLITUDE * sampled(ImitatingEffect(touch=touch))[: int(0.5 * DURATION * SAMPLING_RATE)]
    noisy = clean + 0.1 * NOISE * np.random.default_rng(1).standard_normal(clean.size)
    return fb.make_record(np.arange(clean.size) / SAMPLING_RATE, noisy, "displacement", synthetic=True)


class _Watched:
    """The settings as they are, and the names of those that have been read."""

    def __init__(self) -> None:
        self.read: set[str] = set()

    def __getattr__(self, name: str) -> Any:
        self.read.add(name)
        return getattr(_AS_THEY_ARE, name)


@cache
def _as_they_are(samples: int, measured: bool, seed: int) -> list[tuple[Loop, dict[str, Any], set[str]]]:
    """Every loop of the corpus, what it gives, and the settings it reads: no other can move it."""
    found = []
    for loop in _corpus(samples, measured):
        watched = _Watched()
        with _in_place(watched):
            found.append((loop, _closed(loop, seed), watched.read))
    return found


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Close the loop on the corpus: verdicts and friction, of each record in a list."""
    seed_of_loop = int(seed.generate_state(1)[0])
    results = []
    for loop, result, read in _as_they_are(config.samples, cell["measured"], seed_of_loop):
        if cell["setting"] in read:
            with using(cell["setting"], cell["factor"]):
                result = _closed(loop, seed_of_loop)
        results.append(result)
    return {name: [result[name] for result in results] for name in results[0]}


def _closed(loop: Loop, seed: int) -> dict[str, Any]:
    """Verdict, mean and sd of friction and width of its interval; no friction where a record is refused."""
    records, system, effects = loop
    try:
        report = fb.close_loop(records, system, effects=effects, seed=seed)
    except fb.InputError:
        return {"verdict": "refused", "report": "", "mean": math.nan, "sd": math.nan, "width": math.nan}
    low, high = report.friction_after["interval90"]
    return {
        "verdict": report.verdict,
        "report": settings_key([report.to_dict() | {"elapsed_s": None}]),
        "mean": report.friction_after["mean"],
        "sd": report.friction_after["sd"],
        "width": high - low,
    }


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
    """Reports and verdicts that one variation changes, the largest shift of friction [sd], and of a width."""

    reports: int
    verdicts: int
    shift: float
    width: float

    @classmethod
    def of(cls, varied: xr.Dataset, default: xr.Dataset) -> _Move:
        # a record that is refused has no friction
        shift = np.nan_to_num(np.abs(varied["mean"] - default["mean"]) / default["sd"])
        width = np.nan_to_num(np.abs(varied["width"] / default["width"] - 1.0))
        changed = [int((varied[what] != default[what]).sum()) for what in ("report", "verdict")]
        return cls(*changed, float(np.max(shift)), float(np.max(width)))

    @property
    def nothing(self) -> bool:
        return self.reports == 0

    def __str__(self) -> str:
        if self.nothing:
            return "nothing"
        moved = self.shift > 0.0 or self.width > 0.0
        if not (self.verdicts or moved):
            return "reports alone"
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
    question="what depends on each number that decides in a closed loop?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="target",
    group="own",
    paired=("setting", "factor", "measured"),
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
