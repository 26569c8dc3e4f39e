"""Is the loop calibrated? Records drawn from the very priors that it states."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import friction_bayes as fb
from experiments.blind.scoring import set_name, widths_off
from experiments.loop_priors import NAMES, RANDOM_FORCE, SLIGHT, draw
from experiments.method_tables import share_error, with_error
from experiments.runner import Cell, Experiment, Row, main
from friction_bayes.validation.calibration import Calibration, uniformity

__all__ = ["EXPERIMENT", "FALSE_ALARM_RATE", "place_of_truth", "rank_test", "reliability"]

FALSE_ALARM_RATE = 0.01
"""Of all checks of the ranks together."""
_TARGET = "88 .. 92 %"
_EDGES = (0.0, 0.05, 0.2, 0.5, 0.8, 0.95, 1.0)
"""Of the bins of stated probabilities."""
_WITHOUT_VERDICT = ("refused", "crashed")
_SURE = 1e-3
_LONG = 20
_BENT = ("stribeck_friction", "presliding")
"""Effects with a parameter that the loop takes at a few values along the measured motion."""


@dataclass(frozen=True)
class Config:
    """Records."""

    records: int = 300
    records_full: int = 500


def cells(config: Config, full: bool) -> list[Cell]:
    """One cell a record."""
    return [{"replicate": i} for i in range(config.records_full if full else config.records)]


def place_of_truth(draws: NDArray[np.float64], truth: float, rng: np.random.Generator) -> float:
    """Posterior distribution function at the truth, spread over its step and over draws that equal it."""
    below, equal = int(np.sum(draws < truth)), int(np.sum(draws == truth))
    return float((below + rng.random() * (equal + 1)) / (draws.size + 1))


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Draw, close the loop on nothing but record and system, then open the seal."""
    seed_of_record, seed_of_loop, seed_of_rank = seed.spawn(3)
    started = time.process_time()
    drawn = draw(seed_of_record)
    known = {
        "quantity": drawn.setting.quantity,
        "half_cycles": drawn.setting.half_cycles,
        "samples": drawn.setting.samples,
        "snr_db": drawn.setting.snr_db,
        "rests": drawn.rests,
        "effects": set_name(drawn.effects),
        "others": len(set(drawn.effects) - {RANDOM_FORCE}),
        "random_force": RANDOM_FORCE in drawn.effects,
        "slight": set_name(tuple(drawn.slight)),
        "dry": drawn.friction / drawn.loss,
        "offered": [float(name in drawn.offered) for name in NAMES],
        "acts": [float(name in drawn.effects) for name in NAMES],
        "truth": json.dumps({"setting": asdict(drawn.setting), "parameters": drawn.parameters}),
        "attempts": drawn.attempts,
        "elapsed_drawing": time.process_time() - started,
    }
    busy = time.process_time()
    try:
        report = fb.close_loop(
            [drawn.record],
            fb.Oscillator(**drawn.setting.system),
            seed=int(seed_of_loop.generate_state(1)[0]),
        )
    except fb.InputError as refusal:
        return known | _without_verdict("refused", refusal) | {"elapsed": time.process_time() - busy}
    except Exception as crash:  # counted in the table, so that one record does not end the run
        return known | _without_verdict("crashed", crash) | {"elapsed": time.process_time() - busy}
    elapsed = time.process_time() - busy
    after = report.friction_after
    low, high = after["interval90"]
    draws = report.posterior["mixture"]["friction"].values.ravel()
    candidates = report.candidates
    truth = set(drawn.effects)
    return known | {
        "verdict": report.verdict,
        "because": ", ".join(report.because),
        "said": set_name(candidates[0]["effects"]),
        "said_probability": candidates[0]["probability"],
        "truth_probability": math.fsum(c["probability"] for c in candidates if set(c["effects"]) == truth),
        "place": place_of_truth(draws, drawn.friction, np.random.default_rng(seed_of_rank)),
        "covered": float(low <= drawn.friction <= high),
        "low": low / drawn.loss,
        "high": high / drawn.loss,
        "mean": after["mean"] / drawn.loss,
        "widths_off": widths_off(after, drawn.friction),
        "probabilities": [
            math.fsum(c["probability"] for c in candidates if name in c["effects"]) for name in NAMES
        ],
        "elapsed": elapsed,
    }


def _without_verdict(word: str, why: Exception) -> dict[str, Any]:
    """The fields of a record that the loop refused or failed on: every number is nan."""
    numbers = (
        "said_probability",
        "truth_probability",
        "place",
        "covered",
        "low",
        "high",
        "mean",
        "widths_off",
    )
    nothing = [math.nan] * len(NAMES)
    texts = {"verdict": word, "because": repr(why), "said": word, "probabilities": nothing}
    return texts | dict.fromkeys(numbers, math.nan)


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """One entry a record; JSON has null for what is no number, and for infinitely many widths."""
    columns: dict[str, Any] = {"replicate": ("record", [int(cell["replicate"]) for cell in cells])}
    for name, first in results[0].items():
        values = [result[name] for result in results]
        if isinstance(first, list):
            columns[name] = (("record", "effect"), np.array(values, dtype=float))
        elif isinstance(first, str | bool | int):
            columns[name] = ("record", values)
        else:
            columns[name] = ("record", np.array(values, dtype=float))
    dataset = xr.Dataset(columns, coords={"effect": list(NAMES)})
    nothing = dataset["verdict"].isin(_WITHOUT_VERDICT)
    widths = dataset["widths_off"]
    return dataset.assign(widths_off=widths.where(widths.notnull() | nothing, math.inf))


def judged(dataset: xr.Dataset) -> xr.Dataset:
    """Those that have a verdict."""
    return dataset.isel(record=~dataset["verdict"].isin(_WITHOUT_VERDICT).values)


def rank_test(dataset: xr.Dataset) -> Calibration:
    """Test of the places of the true friction in its posterior: uniform if the loop is calibrated."""
    return uniformity(judged(dataset)["place"].values, false_alarm_rate=FALSE_ALARM_RATE)


def reliability(dataset: xr.Dataset, names: Sequence[str] | None = None) -> xr.Dataset:
    """Stated probabilities of effects against the share that acted, dimension ``bin``.

    Returns
    -------
    xarray.Dataset
        ``n`` statements, their mean ``stated``, the share that was ``true``, and ``z``, the deviation over
        what chance makes of them.
    """
    records = judged(dataset)
    if names is not None:
        records = records.sel(effect=list(names))
    kept = records["offered"].values > 0.0
    p, acts = (records[name].values[kept] for name in ("probabilities", "acts"))
    which = np.clip(np.digitize(p, _EDGES) - 1, 0, len(_EDGES) - 2)
    lines = [_against(p[which == b], acts[which == b]) for b in range(len(_EDGES) - 1)]
    columns = zip(*lines, strict=True)
    names_of = ("n", "stated", "true", "z")
    return xr.Dataset(
        {name: ("bin", np.array(values)) for name, values in zip(names_of, columns, strict=True)},
        coords={"low": ("bin", list(_EDGES[:-1])), "high": ("bin", list(_EDGES[1:]))},
    )


def _against(p: NDArray[np.float64], acts: NDArray[np.float64]) -> tuple[int, float, float, float]:
    """How many, mean probability, share true, and how far apart they are in standard deviations.

    For those, no probability counts as nearer to zero or one than a thousandth.
    """
    if p.size == 0:
        return 0, math.nan, math.nan, math.nan
    inner = np.clip(p, _SURE, 1.0 - _SURE)
    spread = math.sqrt(float(np.sum(inner * (1.0 - inner))))
    return p.size, float(p.mean()), float(acts.mean()), float(acts.sum() - p.sum()) / spread


def _coverage(what: str, records: xr.Dataset, target: str = "") -> Row:
    n = records.sizes["record"]
    if n == 0:
        return Row(what, "no records", target, "")
    gross = int(np.sum(_gross(records)))
    below = int(np.sum(records["place"] < 0.05))
    above = int(np.sum(records["place"] > 0.95))
    width = float((records["high"] - records["low"]).median())
    return Row(
        what,
        f"covers {_share(records['covered'])}",
        target,
        f"{n} records; truth below in {below}, above in {above}, a whole width off in {gross}; "
        f"median width {100.0 * width:.2g} % of the friction that explains the loss",
    )


def _gross(records: xr.Dataset) -> xr.DataArray:
    """Whether the truth lies outside the interval, and more than its width off the mean."""
    return (records["widths_off"] > 1.0) & (records["covered"] == 0.0)


def _share(which: xr.DataArray) -> str:
    rate, error = share_error(which)
    return f"{with_error(100.0 * rate, 100.0 * error)} %"


def _splits(records: xr.Dataset) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    for verdict in ("adequate", "explained", "ambiguous", "unexplained"):
        yield f"verdict {verdict}", records["verdict"].values == verdict
    yield "verdict other than unexplained", records["verdict"].values != "unexplained"
    for quantity in np.unique(records["quantity"]):
        yield str(quantity), records["quantity"].values == quantity
    forced, others = records["random_force"].values.astype(bool), records["others"].values
    yield "with a random force", forced
    yield "without one", ~forced
    for count in range(3):
        yield f"{count} other effects", others == count
    yield "3 or more", others > 2
    none, slight = ~forced & (others == 0), records["slight"].values != set_name(())
    yield "nothing at all", none & ~slight
    yield "nothing but what is slight", none & slight
    for name in (*SLIGHT, RANDOM_FORCE):
        acts = [name in each.split("+") for each in records["slight"].values.tolist()]
        yield f"slight {name.replace('_', ' ')}", np.array(acts, dtype=bool)
    acts = records["acts"]
    bent = acts.sel(effect=list(_BENT)).values.any(axis=1)
    clipped = acts.sel(effect="sensor_clipping").values > 0.0
    yield "Stribeck friction or pre-sliding", bent
    yield "clipped", clipped
    yield "neither", ~bent & ~clipped
    long = records["half_cycles"].values > _LONG
    yield f"up to {_LONG} half cycles", ~long
    yield "more", long
    dry = records["dry"].values > 0.0
    yield "dry friction", dry
    yield "no dry friction", ~dry


def _rank_rows(dataset: xr.Dataset) -> list[Row]:
    test = rank_test(dataset)
    failed = "not uniform" if test.failed else "uniform"
    return [
        Row("ranks of friction", failed, "uniform", f"{FALSE_ALARM_RATE:.0%} false alarm, all checks"),
        *(
            Row(
                f"their {check.name}",
                f"{check.sampled:.3f}",
                f"{check.expected:.3f}",
                f"{check.z:+.1f} standard errors, p = {check.p_value:.2g}, fails below {check.level:.2g}",
            )
            for check in test.checks
        ),
    ]


def _reliability_rows(dataset: xr.Dataset, what: str, names: Sequence[str]) -> list[Row]:
    table = reliability(dataset, names)
    return [
        Row(
            f"{what} stated {b['low'].item():g} .. {b['high'].item():g}",
            f"acts in {b['true'].item():.3f}",
            f"{b['stated'].item():.3f}",
            f"{b['n'].item():.0f} statements, {b['z'].item():+.1f} sd",
        )
        for b in (table.isel(bin=i) for i in range(table.sizes["bin"]))
        if b["n"].item()
    ]


def rows(dataset: xr.Dataset) -> list[Row]:
    """Coverage over all and by kind of record, the test of the ranks, and the reliability diagram."""
    records = judged(dataset)
    table = [_coverage("all records", records, _TARGET)]
    table += [_coverage(what, records.isel(record=which)) for what, which in _splits(records)]
    table += _rank_rows(dataset)
    gross = _gross(records)
    table.append(Row("truth more than a whole width off", _share(gross), "", f"{int(gross.sum())} records"))
    names = dataset["effect"].values.tolist()
    effects = [name for name in names if name != RANDOM_FORCE]
    table += _reliability_rows(dataset, "effect", effects)
    table += _reliability_rows(dataset, "random force", [RANDOM_FORCE])
    for name in names:
        kept = records["offered"].sel(effect=name).values > 0.0
        p, acts = (records[each].sel(effect=name).values[kept] for each in ("probabilities", "acts"))
        n, _, _, z = _against(p, acts)
        given = p[acts > 0.0]
        found = f"mean probability {given.mean():.2f} where it acts" if given.size else ""
        table.append(
            Row(
                f"{name.replace('_', ' ')} acts",
                f"{acts.sum():.0f} of {n}",
                f"{p.sum():.1f}",
                f"{found}; {z:+.1f} sd",
            )
        )
    for word in _WITHOUT_VERDICT:
        count = int((dataset["verdict"] == word).sum())
        table.append(Row(word, f"{count} of {dataset.sizes['record']}", "0", ""))
    seconds = dataset["elapsed"]
    remark = f"median; mean {float(seconds.mean()):.2g} s, longest {float(seconds.max()):.2g} s"
    return [*table, Row("time a record", f"{float(seconds.median()):.2g} s", "", remark)]


EXPERIMENT = Experiment(
    name="loop_calibration",
    question="is the loop calibrated on records drawn from the priors that it states?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="target",
    group="blind",
)

if __name__ == "__main__":
    main(EXPERIMENT)
