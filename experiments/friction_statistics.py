"""The paper's friction samples by their sufficient statistics, on the records that its claims are about.

Eqs. (5)-(8) use nothing of a record but the number, mean and centred sum of squares of its friction samples:
with these three kept, every prior is arithmetic.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.noise_sweep import noise_for
from experiments.paper_numbers import printed
from experiments.reduced_data_set import DATA_SETS, last_begins, last_part
from experiments.rig import Rig, run_rig, system_of, true_friction
from experiments.sampling_rate_sweep import down_sampled
from friction_bayes.conjugate.sufficient_statistics import NormalStatistics
from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.friction_samples import PEAKS, friction_samples, peak_amplitudes
from friction_bayes.mechanics.testbed import PAPER_SYSTEM, paper_example

__all__ = [
    "ALL",
    "ALL_SAMPLES",
    "EVERY_COUNT",
    "KEEP_EVERY",
    "LAST_SHARES",
    "MASS",
    "NOISE",
    "REDUCED",
    "SNR_DB",
    "SPACED_COUNTS",
    "VARIABLES",
    "Samples",
    "at_noise",
    "collect",
    "first_samples",
    "heavy",
    "of_set_2",
]

VARIABLES = {
    "count": ("1", "friction samples"),
    "mean": ("N", "their mean"),
    "squares": ("N^2", "sum of their squared deviations from it"),
    "truth": ("N", "friction, or the mean friction that the run had"),
    "rmse_precision": ("1/N^2", "precision that the RMS of the amplitudes about a straight line means"),
}
ALL = "example"
"""The whole record of section 3, at the noise that the paper states."""
REDUCED = 0.2
"""Share of the motion that the reduced data set keeps."""


ALL_SAMPLES = int(printed("example-amplitudes"))
"""Friction samples of the whole example, n of Eqs. (5)-(8): what the paper calls its evidence."""
EVERY_COUNT = tuple(range(2, ALL_SAMPLES + 1))
"""Friction samples used of the example, Fig. 4: every number that gives a precision without a prior."""
SPACED_COUNTS = (2, 3, 4, 5, 7, 9, 12, 15, 19, 24, 29, 34, 39, 44, ALL_SAMPLES)
"""The same spaced about logarithmically, which gives the first few samples most of a rank correlation."""
SNR_DB = (14.7, 8.6)
"""Further signal-to-noise ratios of the example, section 3 [dB]."""
NOISE, LAST_SHARES, KEEP_EVERY = (1.0, 3.0), (1.0, 0.4, REDUCED, 0.12), (1, 10, 100)
"""Of data set 2: noise over the sensor's, share of the motion kept, one sample kept in how many."""
MASS = 19.5
"""Mass at which all is run again that the paper gives a precision of, from a release that leaves the periods
as they were [kg]: white noise at nominal peaks then gives the 5.7 of data set 1."""


def first_samples(count: int) -> str:
    """Name of the example by its first friction samples; by all of them it is :data:`ALL`."""
    return ALL if count == ALL_SAMPLES else f"{ALL}, {count} samples"


def at_noise(level: float) -> str:
    """Name of the example at another signal-to-noise ratio [dB]."""
    return f"{ALL}, {level:g} dB"


def of_set_2(noise: float, share: float, step: int) -> str:
    """Name of a condition of data set 2."""
    return f"set 2, noise x{noise:g}, last {share:g}, 1/{step}"


def heavy(data_set: str, step: int = 1) -> str:
    """Name of a data set at the other mass, and of the fraction of its samples."""
    return f"{MASS:g} kg, set {data_set}, 1/{step}"


@dataclass(frozen=True)
class Samples:
    """Friction samples of one record under one condition.

    Attributes
    ----------
    by_peaks : list of ndarray
        In the order of the readings of a peak; empty where the record gives no two amplitudes.
    truth : float
        Friction, or the mean friction that the run had [N].
    rmse_precision : tuple of float
        Of the whole example, as :data:`VARIABLES` says, a number a reading.
    """

    by_peaks: list[Array]
    truth: float
    rmse_precision: tuple[float, ...] = (math.nan,) * len(PEAKS)

    def statistics(self) -> dict[str, list[float]]:
        """Names of :data:`VARIABLES`, a number a reading; nan where there are no samples."""
        data = [NormalStatistics.of(part) if part.size else None for part in self.by_peaks]
        return {
            "count": [math.nan if each is None else float(each.n) for each in data],
            "mean": [math.nan if each is None else each.mean for each in data],
            "squares": [math.nan if each is None else each.sum_of_squares for each in data],
            "truth": [self.truth] * len(data),
            "rmse_precision": list(self.rmse_precision),
        }


def collect(rig: Rig, seed: int) -> dict[str, Samples]:
    """Friction samples of one replicate by condition.

    Parameters
    ----------
    rig : Rig
    seed : int
        Of noise and friction; conditions of one record share them.
    """
    return dict(_on_testbed(rig, seed)) | dict(_on_example(seed))


def _on_example(seed: int) -> Iterator[tuple[str, Samples]]:
    truth = printed("example-friction")
    decay = _decay(paper_example(seed), PAPER_SYSTEM)
    samples = [friction_samples(decay, peaks) for peaks in PEAKS]
    for count in EVERY_COUNT[:-1]:
        yield first_samples(count), Samples([part[:count] for part in samples], truth)
    rmse = tuple(_precision_of_rmse(*peak_amplitudes(decay, peaks)) for peaks in PEAKS)
    yield ALL, Samples(samples, truth, rmse)
    for level in SNR_DB:
        noisier = _decay(paper_example(seed, noise_sd=noise_for(level)), PAPER_SYSTEM)
        yield at_noise(level), Samples([friction_samples(noisier, peaks) for peaks in PEAKS], truth)


def _on_testbed(rig: Rig, seed: int) -> Iterator[tuple[str, Samples]]:
    for noise in NOISE:
        noisy = replace(rig, accelerometer_noise=noise * rig.accelerometer_noise)
        signals = run_rig(noisy, DATA_SETS["2"], seed=seed)
        for share, step in product(LAST_SHARES, KEEP_EVERY):
            yield of_set_2(noise, share, step), _part(signals, noisy, share, step, seed)
    yield "set 1", _part(run_rig(rig, DATA_SETS["1"], seed=seed), rig, 1.0, 1, seed)
    heavier = replace(rig, mass=MASS, release=rig.release * rig.mass / MASS)
    for data_set, friction in DATA_SETS.items():
        reduced = "reduced" in data_set
        signals = run_rig(heavier, friction, seed=seed)
        for step in KEEP_EVERY if reduced else (1,):
            yield heavy(data_set, step), _part(signals, heavier, REDUCED if reduced else 1.0, step, seed)


def _part(signals: Mapping[str, xr.DataArray], rig: Rig, share: float, step: int, seed: int) -> Samples:
    whole = signals["acceleration"]
    record = down_sampled(last_part(whole, share) if share < 1.0 else whole, step, seed)
    truth = true_friction(signals, last_begins(whole, share))
    try:
        decay = _decay(record, system_of(rig))
        return Samples([friction_samples(decay, peaks) for peaks in PEAKS], truth)
    except fb.InputError:
        return Samples([np.empty(0) for _ in PEAKS], truth)


def _decay(record: xr.DataArray, system: Oscillator) -> FreeDecay:
    with warnings.catch_warnings():
        # a frequency read off few noisy samples may differ from the declared one: that is in the error
        warnings.simplefilter("ignore", fb.RecordWarning)
        return fb.estimate(record, system, method="normal-gamma").decay


def _precision_of_rmse(time: Array, amplitude: Array) -> float:
    """Precision of a friction sample ``k (A_i - A_i+1) / 4`` of amplitudes that scatter by their RMS."""
    residual = amplitude - np.polyval(np.polyfit(time, amplitude, 1), time)
    return 8.0 / (PAPER_SYSTEM.stiffness**2 * float(np.mean(residual**2)))
