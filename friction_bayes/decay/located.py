"""Where the free decays of many records lie, and what was found of each."""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask

__all__ = [
    "CONSTANT",
    "FOUND",
    "LEAST_HALF_CYCLES",
    "NOT_DECAYING",
    "NOT_FINITE",
    "NO_OSCILLATION",
    "SEVERAL_DECAYS",
    "SEVERAL_MODES",
    "TOO_SHORT",
    "Located",
]

FOUND, NOT_FINITE, CONSTANT, NO_OSCILLATION, TOO_SHORT, NOT_DECAYING, SEVERAL_MODES, SEVERAL_DECAYS = (
    cast(int, status) for status in np.arange(8)
)
"""Status of a record: its moving part was found, or why it was not; no literals, for the kernels' sake."""
LEAST_HALF_CYCLES = 3.0
"""Fewer show no loss of amplitude about a middle."""


class Located(NamedTuple):
    """Where the free decay lies in each of many records, and a rough idea of its motion.

    Attributes
    ----------
    status : ndarray of int, shape (records,)
        :data:`FOUND`, or why nothing was found: the rest of that row is then zero.
    start, stop : ndarray of int, shape (records,)
        The moving part, ``start <= i < stop``.
    frequency : ndarray, shape (records,)
        Angular frequency [rad/sample].
    phase : ndarray, shape (records,)
        Phase of the displacement at ``start``, in [0, 2 pi) [rad].
    rest_position : ndarray, shape (records,)
        In the unit of the signal.
    stops : ndarray of bool, shape (records,)
        Whether the motion ends within the record.
    disturbed : ndarray of int, shape (records,)
        Half cycles before ``start`` that are left out as a hand still acted on them.
    driven : ndarray of bool, shape (records,)
        Whether a part before ``start`` is left out in which no amplitude was lost.
    """

    status: Integers
    start: Integers
    stop: Integers
    frequency: Array
    phase: Array
    rest_position: Array
    stops: Mask
    disturbed: Integers
    driven: Mask
