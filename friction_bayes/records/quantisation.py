"""The step of a digitiser or an encoder: the lattice that the samples of a record lie on."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["ROUNDING", "quantisation_step"]

ROUNDING = 1e-9
"""Share of the range below which two values are one."""
_FEWEST = 20
"""Gaps between neighbouring values that it takes to call them a lattice."""
_MOST_STEPS = 4
"""Longest gap that is looked at, in steps: in longer ones printed digits add up."""
_SHARE = 0.2
"""Least share of the gaps that are as short: the rest are where the signal moved fast."""
_OFF = 0.15
"""Share of a step by which a gap may miss a whole number of steps: values are printed with few digits."""
_ON_LATTICE = 0.95
"""Share of the gaps that have to be whole steps; of gaps of any length three tenths would be."""


def quantisation_step(values: ArrayLike) -> float | None:
    """Return the distance between neighbouring levels of a quantised signal.

    The shortest gaps between values that occur are one step; gaps of a few steps must be whole numbers of it.
    What has been filtered or interpolated lies on no lattice any more.

    Parameters
    ----------
    values : array_like, shape (n,)
        The signal as recorded.

    Returns
    -------
    float or None
        In the unit of the signal; None where the values lie on no lattice.
    """
    levels = np.unique(np.asarray(values, dtype=np.float64))
    gaps = np.diff(levels)
    gaps = gaps[gaps > ROUNDING * np.ptp(levels)]
    if gaps.size == 0:
        return None
    step = float(np.mean(gaps[gaps < 1.5 * gaps.min()]))
    few = gaps[gaps < (_MOST_STEPS + 0.5) * step]
    counts = np.rint(few / step)
    step = float(few.sum() / counts.sum())
    whole = np.abs(few / step - counts) < _OFF
    enough = few.size >= max(_FEWEST, _SHARE * gaps.size)
    return step if enough and np.mean(whole) >= _ON_LATTICE else None
