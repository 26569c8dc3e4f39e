"""The paper's claims of sections 3 and 4 as numbers that a prior changes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import xarray as xr
from scipy import stats

from experiments.acceptance_roc import GOOD, roc_area
from experiments.claims import After, Claim, in_band, median, pooled, share
from experiments.credible_area import credible_area
from experiments.friction_statistics import (
    ALL,
    EVERY_COUNT,
    KEEP_EVERY,
    LAST_SHARES,
    MASS,
    NOISE,
    REDUCED,
    SNR_DB,
    SPACED_COUNTS,
    at_noise,
    first_samples,
    heavy,
    of_set_2,
)
from experiments.joint_evidence import together
from experiments.paper_numbers import printed
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.arrays import Array

__all__ = ["CLAIMS", "GROWING"]

ALIKE = 0.1
"""How far two precisions that are "practically the same" may be apart, relative."""


def _both(first: xr.DataArray, second: xr.DataArray, hit: xr.DataArray) -> xr.DataArray:
    return hit.astype(float).where(first.notnull() & second.notnull())


def _larger(after: After, variable: str, more: str, less: str) -> xr.DataArray:
    values = abs(getattr(after, variable))
    first, second = after.of(values, more), after.of(values, less)
    return _both(first, second, first > second)


def _shrinks(after: After) -> xr.DataArray:
    """Area of the 90 % region after the data over that before."""
    _, lam, alpha, beta = (after.of(parameter, ALL) for parameter in after.parameters)
    before = credible_area(after.prior)

    def area(lam: float, alpha: float, beta: float) -> float:
        return credible_area(NormalGamma(0.0, lam, alpha, beta)) / before

    lam, alpha, beta = xr.broadcast(lam, alpha, beta)
    return xr.apply_ufunc(area, lam, alpha, beta, vectorize=True)


def _rmse_inside(after: After) -> xr.DataArray:
    _, _, alpha, beta = (after.of(parameter, ALL) for parameter in after.parameters)
    meant = after.of(after.data["rmse_precision"], ALL)
    chance = xr.apply_ufunc(stats.gamma.cdf, meant * beta, alpha)
    return ((chance > 0.05) & (chance < 0.95)).astype(float)


GROWING, SPACED = ([first_samples(count) for count in each] for each in (EVERY_COUNT, SPACED_COUNTS))
NOISIER = [at_noise(level) for level in SNR_DB]
THREE_ERRORS = ("example-error", "noise-error-14.7", "noise-error-8.6")
"""Of section 3, by the noise in its order."""
TABLE_2 = FAST, MIDDLE, SLOW = [of_set_2(1.0, REDUCED, step) for step in KEEP_EVERY]
SET_2 = [of_set_2(*each) for each in product(NOISE, LAST_SHARES, KEEP_EVERY)]
FEW, WHOLE = first_samples(5), of_set_2(1.0, 1.0, 1)


def _along_record(after: After, growing: Sequence[str]) -> xr.DataArray:
    """Rank correlation of precision and size of the error as friction samples come in."""
    precision, error = (after.of(each, growing) for each in (after.precision, abs(after.error)))

    def spearman(first: Array, second: Array) -> Array:
        a, b = (stats.rankdata(x, axis=-1) - 0.5 * (len(growing) + 1) for x in (first, second))
        return np.asarray((a * b).sum(-1) / np.sqrt((a**2).sum(-1) * (b**2).sum(-1)))

    return xr.apply_ufunc(spearman, precision, error, input_core_dims=[["condition"], ["condition"]])


def _across_records(after: After) -> Array:
    precision, error = after.of(after.precision, ALL), abs(after.of(after.error, ALL))
    return np.array(
        [
            stats.spearmanr(precision.sel(peaks=peaks), error.sel(peaks=peaks)).statistic
            for peaks in precision["peaks"].values
        ]
    )


def _errors_together(after: After) -> Array:
    """Fisher's chance of errors as small as the paper's, on a record of its own each."""
    errors = abs(after.of(after.error, [ALL, *NOISIER]))
    stated = [0.01 * printed(number) for number in THREE_ERRORS]
    return np.array(
        [
            together(errors.sel(peaks=peaks).transpose("condition", "replicate").values, stated).fisher
            for peaks in errors["peaks"].values
        ]
    )


def _errors_of_one_draw(after: After) -> xr.DataArray:
    """Whether all three errors are as small, where the three levels are one draw of noise times a factor."""
    errors = abs(after.of(after.error, [ALL, *NOISIER]))
    stated = xr.DataArray([0.01 * printed(number) for number in THREE_ERRORS], dims="condition")
    return (errors <= stated.assign_coords(condition=errors["condition"])).all("condition").astype(float)


def _falls_with_noise(after: After) -> xr.DataArray:
    first, second, third = (after.of(after.precision, name) for name in (ALL, *NOISIER))
    return ((first > second) & (second > third)).astype(float)


def _as_paper_decides(after: After) -> xr.DataArray:
    """Whether 30 of 32.2 of the run's own precision at 1 kHz accepts 100 Hz and refuses 10 Hz."""
    fast, middle, slow = (after.of(after.precision, name) for name in TABLE_2)
    least = printed("criterion") / printed("precision-reduced") * fast
    return ((middle >= least) & (slow < least)).astype(float).where(slow.notnull())


def _area(after: After, score: xr.DataArray) -> Array:
    error, scored = after.of(after.error, SET_2), after.of(score, SET_2)
    areas = []
    for peaks in error["peaks"].values:
        one, other = error.sel(peaks=peaks).values.ravel(), scored.sel(peaks=peaks).values.ravel()
        kept = np.isfinite(one) & np.isfinite(other)
        areas.append(roc_area(other[kept], abs(one[kept]) <= GOOD))
    return np.array(areas)


def _placed(what: str, number: str, condition: str, variable: str, factor: float = 1.0) -> Claim:
    """Whether a number of the paper lies in the band of ours."""

    def values(after: After) -> xr.DataArray:
        return factor * after.of(abs(getattr(after, variable)), condition)

    return Claim(
        what,
        "share of the records on the rarer side of the paper's number",
        f"{printed(number):g}",
        in_band(values, printed(number)),
        more_than=0.05,
    )


def _ratio_of_rates(after: After) -> xr.DataArray:
    return after.of(after.precision, MIDDLE) / after.of(after.precision, FAST)


def _alike(after: After) -> xr.DataArray:
    ratio = _ratio_of_rates(after)
    return (abs(ratio - 1.0) < ALIKE).astype(float).where(ratio.notnull())


CLAIMS = [
    _placed("section 3: error", "example-error", ALL, "error", 100.0),
    _placed("section 3: precision", "example-precision", ALL, "precision"),
    Claim(
        "section 3: the RMSE lies in the 90 % interval",
        "share of the records",
        "it does",
        share(_rmse_inside),
        0.5,
    ),
    Claim(
        "section 3: the 90 % region shrinks",
        "its area, after over before, median",
        "much smaller",
        median(_shrinks),
        None,
        1.0,
    ),
    _placed("section 3: error at 14.7 dB", "noise-error-14.7", NOISIER[0], "error", 100.0),
    _placed("section 3: error at 8.6 dB", "noise-error-8.6", NOISIER[1], "error", 100.0),
    Claim(
        "section 3: its three errors together, independent records",
        "chance by Fisher's combined test",
        " / ".join(f"{printed(number):g}" for number in THREE_ERRORS) + " %",
        pooled(_errors_together),
        0.05,
    ),
    Claim(
        "section 3: its three errors together, one draw of noise scaled",
        "share of the draws as close at all three levels",
        " / ".join(f"{printed(number):g}" for number in THREE_ERRORS) + " %",
        share(_errors_of_one_draw),
        0.05,
    ),
    Claim(
        "section 3: precision falls from 20 to 14.7 to 8.6 dB",
        "share of the records",
        "measures the deviation",
        share(_falls_with_noise),
        0.5,
    ),
    Claim(
        "Fig. 4: precision and |error| as data come in",
        "rank correlation along a record, every number of samples, median",
        "negative",
        median(lambda after: _along_record(after, GROWING)),
        None,
        0.0,
    ),
    Claim(
        "Fig. 4: the same over numbers of samples spaced logarithmically",
        f"{len(SPACED)} numbers instead of {len(GROWING)}",
        "negative",
        median(lambda after: _along_record(after, SPACED)),
        None,
        0.0,
    ),
    Claim(
        "Fig. 4: precision higher with all samples than with 5",
        "share of the records",
        "higher",
        share(lambda after: _larger(after, "precision", ALL, FEW)),
        0.5,
    ),
    Claim(
        "section 3: precision and |error| across records of equal length",
        "rank correlation",
        "negative",
        pooled(_across_records),
        None,
        0.0,
    ),
    Claim(
        "section 4: precision higher on set 2 than on set 1",
        "share of the runs",
        "11.6 against 5.7",
        share(lambda after: _larger(after, "precision", WHOLE, "set 1")),
        0.5,
    ),
    Claim(
        "section 4: precision higher on the reduced set",
        "share of the runs",
        "32.2 against 11.6",
        share(lambda after: _larger(after, "precision", FAST, WHOLE)),
        0.5,
    ),
    Claim(
        "Table 2: |error| grows from 1 kHz to 10 Hz",
        "share of the runs",
        "10.4 to 20.1 %",
        share(lambda after: _larger(after, "error", SLOW, FAST)),
        0.5,
    ),
    Claim(
        "Table 2: precision falls from 1 kHz to 10 Hz",
        "share of the runs",
        "32.2 to 27.5",
        share(lambda after: _larger(after, "precision", FAST, SLOW)),
        0.5,
    ),
    Claim(
        "Table 2: precision at 100 Hz over that at 1 kHz",
        "median of the ratio",
        "1.02",
        median(_ratio_of_rates),
    ),
    Claim(
        "Table 2: precisions at 100 Hz and 1 kHz within 10 %",
        "share of the runs",
        "practically the same",
        share(_alike),
        0.5,
    ),
    Claim(
        "Table 2: the run's own criterion takes 100 Hz and refuses 10 Hz",
        "share of the runs",
        "30 of its own 32.2",
        share(_as_paper_decides),
        0.5,
    ),
    Claim(
        "acceptance within 10 %: area, precision",
        "area under the curve, data set 2 under every condition",
        "a criterion",
        pooled(lambda after: _area(after, after.precision)),
        0.5,
    ),
    Claim(
        "acceptance within 10 %: area, width of the interval",
        "area under the curve",
        "",
        pooled(lambda after: _area(after, -after.relative_width)),
        0.5,
    ),
    *(
        _placed(f"{where}: precision", number, condition, "precision")
        for where, number, condition in (
            ("set 1", "precision-1", "set 1"),
            ("set 2", "precision-2", WHOLE),
            ("reduced set", "precision-reduced", FAST),
            ("reduced set, 100 Hz", "precision-100", MIDDLE),
            ("reduced set, 10 Hz", "precision-10", SLOW),
            (f"set 1 at {MASS:g} kg", "precision-1", heavy("1")),
            (f"set 2 at {MASS:g} kg", "precision-2", heavy("2")),
            *(
                (f"reduced set at {MASS:g} kg{rate}", number, heavy("2-reduced", step))
                for rate, number, step in (
                    ("", "precision-reduced", 1),
                    (", 100 Hz", "precision-100", 10),
                    (", 10 Hz", "precision-10", 100),
                )
            ),
        )
    ),
]
"""Every claim that a prior can touch, those of section 3 first."""
