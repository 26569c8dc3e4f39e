"""Does the remaining life hold under laws of wear that are not the model's? One law, and laws averaged.

Paths of friction are drawn from laws written here, none of which knows the model: steady, quadratic,
exponential, square root, saturating (crossing the threshold or stopping short of it), a kink (the rate rises
four- to fivefold), a gamma process, shocks, one jump, none. Estimates at the detection points are the
friction with normal errors of known size; some machines scatter from run to run besides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from experiments.method_tables import share_error, with_error
from experiments.runner import Cell, Experiment, Row, main
from experiments.sweeps import lay_out
from friction_bayes.core.arrays import Array
from friction_bayes.monitor.laws import fit_laws
from friction_bayes.monitor.remaining_life import RemainingLife, remaining_life
from friction_bayes.monitor.wear import fit_wear

__all__ = ["EXPERIMENT", "LAWS", "Config", "Path"]

_NAMES = {"averaged": "laws averaged by evidence", "one": "steady wear alone"}
VARIABLES: dict[str, tuple[str, str]] = {
    "true_life": ("1", "time from Tn till the threshold is first reached, in spans; infinite: never"),
    **{
        f"{name}_{what}": ("1", f"{long}, {text}")
        for name, long in _NAMES.items()
        for what, text in {
            "low": "5 % quantile of the remaining life",
            "median": "its median",
            "high": "its 95 % quantile",
            "covers": "whether the 90 % interval covers the true remaining life",
            "never": "probability that the threshold is never reached",
        }.items()
    },
}


@dataclass(frozen=True)
class Config:
    """Machines and their estimates; friction begins at 1, the time observed is 1."""

    records: int = 24
    records_full: int = 200
    points: tuple[int, ...] = (64,)
    gain: float = 0.6
    gain_spread: float = 0.3
    error: float = 0.007
    largest_scatter: float = 0.02


@dataclass(frozen=True)
class Path:
    """Friction less its start at the points, the distance that is left at Tn, and the life that remains."""

    worn: Array
    left: float
    life: float


def _deterministic(shape: Callable[[Array], Array], inverse: Callable[[float], float]) -> Callable[..., Path]:
    """Path of a shape that is 0 at T1 and 1 at Tn."""

    def draw(times: Array, gain: float, rng: np.random.Generator) -> Path:
        beyond = float(rng.uniform(0.2, 1.5))
        return Path(gain * shape(times), gain * beyond, inverse(1.0 + beyond) - 1.0)

    return draw


def _exponential(times: Array, gain: float, rng: np.random.Generator) -> Path:
    rate = math.log1p(gain)
    left = gain * float(rng.uniform(0.2, 1.5))
    return Path(np.expm1(rate * times), left, math.log1p(gain + left) / rate - 1.0)


def _saturating(crosses: bool) -> Callable[..., Path]:
    def draw(times: Array, gain: float, rng: np.random.Generator) -> Path:
        rate = float(rng.uniform(1.0, 3.0))
        limit = gain / -math.expm1(-rate)
        share = float(rng.uniform(0.1, 0.8) if crosses else rng.uniform(1.2, 3.0))
        left = share * (limit - gain)
        life = -math.log1p(-(gain + left) / limit) / rate - 1.0 if crosses else math.inf
        return Path(-limit * np.expm1(-rate * times), left, life)

    return draw


def _kink(times: Array, gain: float, rng: np.random.Generator) -> Path:
    when, faster = float(rng.uniform(0.3, 0.9)), float(rng.uniform(4.0, 5.0))
    slow = gain / (when + faster * (1.0 - when))
    left = gain * float(rng.uniform(0.2, 1.5))
    worn = np.where(times < when, slow * times, gain - faster * slow * (1.0 - times))
    return Path(worn, left, left / (faster * slow))


def _increasing(
    increment: Callable[[float, float, int, np.random.Generator], Array],
) -> Callable[..., Path]:
    """Path of independent increments over steps of 1/640 of the time observed."""

    def draw(times: Array, gain: float, rng: np.random.Generator) -> Path:
        step = 1.0 / 640.0
        rate = float(rng.uniform(8.0, 40.0))
        path = np.concatenate([[0.0], np.cumsum(increment(rate * step, gain / rate, 64_000, rng))])
        worn = np.interp(times, step * np.arange(path.size), path)
        left = gain * float(rng.uniform(0.2, 1.5))
        first = int(np.searchsorted(path, worn[-1] + left))
        return Path(worn, left, first * step - 1.0)

    return draw


def _shocks(mean: float, size: float, n: int, rng: np.random.Generator) -> Array:
    return rng.gamma(np.maximum(rng.poisson(mean, n), 1e-12), size)


def _jump(times: Array, gain: float, rng: np.random.Generator) -> Path:
    worn = gain * (times > float(rng.uniform(0.3, 0.7)))
    return Path(worn, gain * float(rng.uniform(0.2, 1.5)), math.inf)


def _constant(times: Array, gain: float, rng: np.random.Generator) -> Path:
    return Path(np.zeros(times.size), gain * float(rng.uniform(0.2, 1.5)), math.inf)


LAWS: dict[str, Callable[[Array, float, np.random.Generator], Path]] = {
    "steady": _deterministic(lambda time: time, lambda worn: worn),
    "quadratic": _deterministic(lambda time: time**2, math.sqrt),
    "exponential": _exponential,
    "square root": _deterministic(np.sqrt, lambda worn: worn**2),
    "saturating, crosses": _saturating(True),
    "saturating, stops short": _saturating(False),
    "kink": _kink,
    "gamma process": _increasing(lambda shape, size, n, rng: rng.gamma(shape, size, n)),
    "shocks": _increasing(_shocks),
    "one jump": _jump,
    "none": _constant,
}


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every law and number of points."""
    return [
        {"law": law, "points": points, "replicate": replicate}
        for replicate in range(config.records_full if full else config.records)
        for law in LAWS
        for points in config.points
    ]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Wear one machine and estimate its remaining life both ways."""
    rng = np.random.default_rng(seed)
    times = np.linspace(0.0, 1.0, cell["points"])
    gain = config.gain * math.exp(config.gain_spread * rng.standard_normal())
    path = LAWS[cell["law"]](times, gain, rng)
    friction = 1.0 + path.worn
    sd = config.error * friction
    scatter = config.largest_scatter * max(rng.uniform(-1.0, 1.0), 0.0)
    estimates = friction + np.hypot(sd, scatter) * rng.standard_normal(times.size)
    threshold = float(friction[-1]) + path.left
    lives: dict[str, RemainingLife] = {
        "averaged": fit_laws(times, estimates, sd).remaining_life(threshold),
        "one": remaining_life(fit_wear(times, estimates, sd), threshold, 1.0),
    }
    found: dict[str, Any] = {"true_life": path.life}
    for name, life in lives.items():
        low, middle, high = (life.ppf(q) for q in (0.05, 0.5, 0.95))
        found |= {
            f"{name}_low": low,
            f"{name}_median": middle,
            f"{name}_high": high,
            f"{name}_covers": float(low <= path.life <= high),
            f"{name}_never": life.never,
        }
    return found


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions law, points, replicate; infinite times, which JSON has not, are put back."""
    dataset = lay_out(cells, results, dims=("law", "points", "replicate"), variables=VARIABLES)
    times = ("true_life", *(f"{name}_{end}" for name in _NAMES for end in ("low", "median", "high")))
    return dataset.assign({name: dataset[name].fillna(math.inf) for name in times})


def _told(one: xr.Dataset, name: str) -> str:
    rate, error = share_error(one[f"{name}_covers"])
    # where more than half of the intervals have no end, their median has none
    with np.errstate(invalid="ignore"):
        width = (one[f"{name}_high"] - one[f"{name}_low"]).fillna(0.0)
        life = one["true_life"].clip(min=0.05)
    ends = float(np.median(width / life)) if np.isfinite(life).all() else math.nan
    text = f"covers {with_error(100.0 * rate, 100.0 * error)} %"
    if math.isnan(ends):
        return f"{text}, never {float(one[f'{name}_never'].median()):.2f}"
    return f"{text}, width {'unbounded' if math.isinf(ends) else f'{ends:.2g}'}"


def rows(dataset: xr.Dataset) -> list[Row]:
    """One row a law and number of points: laws averaged, and steady wear alone."""
    n = dataset.sizes["replicate"]
    return [
        Row(
            f"{law}, {points} points",
            *(_told(dataset.sel(law=law, points=points), name) for name in _NAMES),
            f"n = {n}",
        )
        for law in dataset["law"].values.tolist()
        for points in dataset["points"].values.tolist()
    ]


EXPERIMENT = Experiment(
    name="wear_laws",
    question="does the remaining life hold under other laws of wear?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="steady wear alone",
    group="own",
)

if __name__ == "__main__":
    main(EXPERIMENT)
