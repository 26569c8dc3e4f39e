"""Which criterion separates good estimates from bad ones? The paper's precision parameter and four others."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

import friction_bayes as fb
from experiments.against_emcee import CHECKED, SAMPLED, sampled, verdict_rows
from experiments.against_paper import band
from experiments.paper_numbers import printed
from experiments.reduced_data_set import DATA_SETS, last_begins, last_part
from experiments.rig import Rig, run_rig, system_of, true_friction
from experiments.runner import Cell, Experiment, main
from experiments.sampling_rate_sweep import down_sampled
from experiments.sweeps import lay_out, seeds_of
from experiments.tables import Row
from experiments.testbed_choices import DRAWN_PRIOR
from friction_bayes.core.arrays import Array, Mask
from friction_bayes.decay.whiteness import whiteness
from friction_bayes.estimators.acceptance import accept_by_set_up

__all__ = ["CRITERIA", "EXPERIMENT", "Config"]

GOOD = 0.1
"""Error up to which an estimate should be accepted, relative."""

CRITERIA = {
    "precision": "posterior mean of the paper's precision parameter, high",
    "interval width": "width of its own 90 % interval over its mean, low",
    "evidence": "log evidence of its friction samples under the prior as drawn, per sample, high",
    "residual test": "p-value of Ljung and Box on the residual of the whole-signal fit, high",
    "whole-signal width": "width of the whole-signal fit's 90 % interval over its mean, low",
}
"""What an estimate could be accepted by; each is turned so that more is better."""

VARIABLES = {
    "error": ("1", "(posterior mean - mean friction of the run) / mean friction of the run"),
    "accepted": ("1", "verdict of acceptance by precision relative to the first set-up record"),
    **{name: ("1", meaning) for name, meaning in CRITERIA.items()},
}

READINGS = {"normal-gamma, highest": "highest", "normal-gamma, nominal": "nominal"}
ESTIMATES = ("waveform", *READINGS)
"""What criteria are read off, each against emcee."""


@dataclass(frozen=True)
class Config:
    """What is varied: share of the motion kept, sampling rate, noise in multiples of the sensor's.

    Each run brings ``set_ups`` whole records more, of which the precision that a set-up phase would require;
    the first ``checked`` go through emcee.
    """

    rig: Rig = field(default_factory=Rig)
    last_shares: tuple[float, ...] = (1.0, 0.4, 0.2, 0.12)
    keep_every: tuple[int, ...] = (1, 10, 100)
    noise: tuple[float, ...] = (1.0, 3.0)
    records: int = 40
    records_full: int = 600
    checked: int = CHECKED
    set_ups: int = 6


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """One run a cell, of which every share, rate and noise is an estimate; and as many set-up records."""
    records = config.records_full if full else config.records
    return [{"replicate": i, "check": i < config.checked} for i in range(records)]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """All conditions of one run, and the precision of further runs that serve as set-up records."""
    seeds = seed.generate_state(1 + config.set_ups).tolist()
    _, own = seeds_of(cell, seed)
    of_sampler = own if cell["check"] else None
    columns: dict[str, list[float]] = {name: [] for name in (*VARIABLES, *SAMPLED)}
    set_up = [
        [
            _normal_gamma(run_rig(config.rig, DATA_SETS["2"], seed=own)["acceleration"], config.rig, peaks)
            for peaks in READINGS.values()
        ]
        for own in seeds[1:]
    ]
    conditions = list(product(config.noise, config.last_shares, config.keep_every))
    for noise, share, step in conditions:
        rig = replace(config.rig, accelerometer_noise=noise * config.rig.accelerometer_noise)
        signals = run_rig(rig, DATA_SETS["2"], seed=seeds[0])
        whole = signals["acceleration"]
        truth = true_friction(signals, last_begins(whole, share))
        record = down_sampled(last_part(whole, share) if share < 1.0 else whole, step, seeds[0])
        found, checks = _criteria(record, rig, truth, set_up[0], of_sampler)
        for names, parts in ((VARIABLES, found), (SAMPLED, checks)):
            for name in names:
                columns[name] += [part.get(name, math.nan) for part in parts]
    labels = [f"noise x{noise:g}, last {share:g}, 1/{step}" for noise, share, step in conditions]
    precision = [float(estimate.precision.mean()) for pair in set_up for estimate in pair]
    return {"condition": labels, "set_up_precision": precision, **columns}


def _normal_gamma(record: xr.DataArray, rig: Rig, peaks: str) -> fb.Estimate:
    return fb.estimate(record, system_of(rig), method="normal-gamma", peaks=peaks)


def _criteria(
    record: xr.DataArray, rig: Rig, truth: float, set_up: Sequence[fb.Estimate], seed: int | None
) -> tuple[list[dict[str, float]], list[dict[str, float]]]:
    """One mapping a reading of a peak, empty where the record gives no estimate; one an estimate by emcee.

    ``seed`` is that of the sampler, None where it does not run.
    """
    with warnings.catch_warnings():
        # a frequency read off few samples may differ from the declared one: that is in the error
        warnings.simplefilter("ignore", fb.RecordWarning)
        try:
            whole = fb.estimate(record, system_of(rig), random_force="none")
            estimates = [_normal_gamma(record, rig, peaks) for peaks in READINGS.values()]
        except fb.InputError:
            return [{} for _ in READINGS], [{} for _ in ESTIMATES]
    residual = whole.decay.values - whole.fit.prediction
    shared = {
        "residual test": whiteness(residual).p_value,
        "whole-signal width": -_relative_width(whole.friction),
    }
    prior = fb.NormalGamma(**DRAWN_PRIOR)
    found = []
    for estimate, reference in zip(estimates, set_up, strict=True):
        samples = np.asarray(estimate.fit.target.observed)
        found.append(
            shared
            | {
                "error": float(estimate.friction.mean()) / truth - 1.0,
                "accepted": float(_by_set_up(estimate, reference)),
                "precision": float(estimate.precision.mean()),
                "interval width": -_relative_width(estimate.friction),
                "evidence": prior.log_evidence(samples) / samples.size,
            }
        )
    return found, [{} if seed is None else sampled(each, seed=seed) for each in (whole, *estimates)]


def _by_set_up(estimate: fb.Estimate, set_up: fb.Estimate) -> bool:
    unit = estimate.precision_unit
    return accept_by_set_up(estimate.precision, set_up.precision, unit=unit).accepted


def _relative_width(distribution: Any) -> float:
    low, high = distribution.interval(0.9)
    return float(high - low) / abs(float(distribution.mean()))


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions replicate, condition, method; curves and areas over criterion and method."""
    inner = {"condition": results[0]["condition"], "method": list(READINGS)}
    dataset = lay_out(cells, results, dims=("replicate",), variables=VARIABLES, inner=inner)
    inner = {"condition": results[0]["condition"], "estimate": list(ESTIMATES)}
    dataset = dataset.merge(lay_out(cells, results, dims=("replicate",), variables=SAMPLED, inner=inner))
    false_rate = np.linspace(0.0, 1.0, 201)
    shape = (len(CRITERIA), len(READINGS))
    curve = np.full((*shape, false_rate.size), np.nan)
    area, within, area_sd, within_sd = (np.full(shape, np.nan) for _ in range(4))
    for j, method in enumerate(READINGS):
        mine = dataset.sel({"method": method})
        good = (abs(mine["error"]) <= GOOD).values
        for i, criterion in enumerate(CRITERIA):
            score = mine[criterion].values
            kept = np.isfinite(score) & np.isfinite(mine["error"].values)
            curve[i, j] = roc_curve(score[kept], good[kept], false_rate)
            area[i, j] = roc_area(score[kept], good[kept])
            within[i, j] = _area_within(score, good, kept)
            # runs are the independent units: the conditions of one share its friction and noise
            by_run = [_areas_without(score, good, kept, run) for run in range(len(cells))]
            area_sd[i, j], within_sd[i, j] = np.sqrt((len(cells) - 1) * np.var(by_run, axis=0))
    set_up = np.array([result["set_up_precision"] for result in results]).reshape(-1, len(READINGS))
    share = printed("criterion") / printed("precision-reduced")
    dims = ("criterion", "method")
    return dataset.assign(
        true_rate=((*dims, "false_rate"), curve, {"units": "1", "long_name": "good estimates accepted"}),
        area=(dims, area, {"units": "1", "long_name": "area under the curve, all conditions together"}),
        area_sd=(dims, area_sd, {"units": "1", "long_name": "its standard error, jackknife over runs"}),
        area_within=(dims, within, {"units": "1", "long_name": "area within a condition, averaged"}),
        area_within_sd=(dims, within_sd, {"units": "1", "long_name": "its standard error, likewise"}),
        set_up_threshold=(("set_up", "method"), share * set_up, {"units": "1/N^2"}),
    ).assign_coords(criterion=list(CRITERIA), false_rate=false_rate)


def _areas_without(score: Array, good: Mask, kept: Mask, run: int) -> tuple[float, float]:
    """Area over all conditions, and within one, of all runs but one."""
    others = kept.copy()
    others[run] = False
    return roc_area(score[others], good[others]), _area_within(score, good, others)


def _area_within(score: Array, good: Mask, kept: Mask) -> float:
    """Area within a condition, averaged over those that have good and bad estimates; nan where none has."""
    parts = [
        (roc_area(score[k, c], good[k, c]), k.sum())
        for c in range(score.shape[1])
        if (k := kept[:, c]).any() and 0 < good[k, c].sum() < k.sum()
    ]
    if not parts:
        return math.nan
    values, weights = np.array(parts).T
    return float(np.average(values, weights=weights))


def roc_area(score: Array, good: Mask) -> float:
    """Chance that a good estimate scores above a bad one, ties counted half; nan where there is one kind.

    Parameters
    ----------
    score, good : ndarray, shape (n,)
        More is better; which estimates are good.
    """
    positive = int(good.sum())
    if positive in (0, good.size):
        return math.nan
    ranks = stats.rankdata(score)
    above = ranks[good].sum() - 0.5 * positive * (positive + 1)
    return float(above / (positive * (good.size - positive)))


def roc_curve(score: Array, good: Mask, false_rate: Array) -> Array:
    """Share of good estimates accepted at each share of bad ones accepted, shape of ``false_rate``."""
    order = np.argsort(-score, kind="stable")
    # equal scores are accepted together
    last = np.append(np.diff(score[order]) != 0.0, True)
    hits = np.concatenate([[0.0], np.cumsum(good[order])[last] / max(good.sum(), 1)])
    alarms = np.concatenate([[0.0], np.cumsum(~good[order])[last] / max((~good).sum(), 1)])
    return np.interp(false_rate, alarms, hits)


def rows(dataset: xr.Dataset) -> list[Row]:
    """Areas under the curves, the best first."""
    table = []
    for method in READINGS:
        mine = dataset.sel({"method": method})
        known = int(mine["error"].notnull().sum())
        good = float((abs(mine["error"]) <= GOOD).sum()) / known
        ranked = sorted(CRITERIA, key=lambda name: -float(mine["area"].sel(criterion=name)))
        table.append(_operating_row(mine, method))
        for criterion in ranked:
            one = mine.sel(criterion=criterion)
            table.append(
                Row(
                    f"{method}: area under the curve, {criterion}",
                    f"{float(one['area']):.3f} +- {float(one['area_sd']):.3f}",
                    "a criterion" if criterion == "precision" else "",
                    f"{float(one['area_within']):.3f} +- {float(one['area_within_sd']):.3f} "
                    f"within a condition; {CRITERIA[criterion]}; "
                    f"{100.0 * good:.0f} % of {known} estimates are good",
                )
            )
    return table + verdict_rows(dataset, "estimate")


def _operating_row(mine: xr.Dataset, method: str) -> Row:
    """Shares of the good and of the bad estimates that a set-up record accepts."""
    judged = mine["error"].notnull()
    good = abs(mine["error"]) <= GOOD
    of_good = float(mine["accepted"].where(good).mean())
    of_bad = float(mine["accepted"].where(judged & ~good).mean())
    return Row(
        f"{method}: accepted by precision relative to a set-up record",
        f"{100.0 * of_good:.0f} % of the good, {100.0 * of_bad:.0f} % of the bad",
        f"30 of {printed('precision-reduced'):g}",
        "the rule of friction-bayes estimate --setup: a share of 0.9, or what chance alone allows; "
        f"30 of 32.2 is {band(mine['set_up_threshold'])} 1/N^2 of a whole record's",
    )


EXPERIMENT = Experiment(
    name="acceptance_roc",
    question="which criterion separates good estimates from bad ones?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
