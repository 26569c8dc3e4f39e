"""Records of one rig: does the next record confirm the interval of friction that the last one gave?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from friction_bayes.core.arrays import Array

__all__ = ["RIGS", "records_of", "reduced_chi_square", "sd_of_interval"]

RIGS = {
    "pasco-oscillator without the magnet": ("pasco-oscillator/no-magnet-",),
    "pasco-oscillator with the magnet": ("pasco-oscillator/magnet-",),
    "map-single-pendulum, segments of one decay": (
        "map-single-pendulum/identification-",
        "map-single-pendulum/validation-",
    ),
    "rotary-pendulum": ("rotary-pendulum/",),
}
"""How the names begin of records between which dry friction should be the same."""


def records_of(rig: str, names: Sequence[str]) -> list[int]:
    """Places of the records of a rig."""
    return [k for k, name in enumerate(names) if name.startswith(RIGS[rig])]


def sd_of_interval(low: Array, high: Array) -> Array:
    """Standard deviation of the normal distribution with these 90 % intervals: tails do not count."""
    return (np.asarray(high) - np.asarray(low)) / (2.0 * 1.6448536269514722)


def reduced_chi_square(mean: Array, sd: Array) -> float:
    """Chi-square about the weighted mean over its degrees of freedom: 1 where intervals are honest.

    Parameters
    ----------
    mean, sd : ndarray, shape (records,)
        Records without a number (nan) are left out.
    """
    known = np.isfinite(mean) & np.isfinite(sd)
    mean, weight = mean[known], sd[known] ** -2.0
    common = float(weight @ mean / weight.sum())
    return float(weight @ (mean - common) ** 2) / (mean.size - 1)
