"""An angle that a sensor shows within one turn: where it starts over, it goes on."""

from __future__ import annotations

import math
import warnings

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import RecordWarning
from friction_bayes.records.record import record_name

__all__ = ["ANGLE_UNIT", "HALF_A_TURN", "unwrapped", "with_unwrapped_angle"]

ANGLE_UNIT = "rad"
HALF_A_TURN = math.pi
"""No motion that is sampled well goes farther from one sample to the next."""
_LIKE_OTHERS = 2.0
"""Times the largest step elsewhere that one over the end of the turn may be: a stray sample is far off."""


def with_unwrapped_angle(record: xr.DataArray) -> xr.DataArray:
    """A record whose angle goes on where it started over, as from 360 to 0 degrees; others as they are.

    Parameters
    ----------
    record : xarray.DataArray
        A validated record.

    Warns
    -----
    RecordWarning
        Where the angle starts over.
    """
    if record.attrs["units"] != ANGLE_UNIT:
        return record
    values = unwrapped(np.asarray(record.values, dtype=np.float64))
    if values is None:
        return record
    warnings.warn(
        f"{record_name(record)}: the angle starts over at the end of a turn and is taken to go on there",
        RecordWarning,
        stacklevel=3,
    )
    return record.copy(data=values)


def unwrapped(values: Array) -> Array | None:
    """An angle that goes on where it started over, shape (n,) [rad]; None of one that does not start over."""
    steps = np.diff(values)
    over = np.abs(steps) > HALF_A_TURN
    if not over.any() or over.all() or np.ptp(values) > 2.0 * HALF_A_TURN:
        return None
    found = np.unwrap(values)
    # one of them may be a release too
    across = np.median(np.abs(np.diff(found)[over]))
    return found if across <= _LIKE_OTHERS * np.max(np.abs(steps[~over])) else None
