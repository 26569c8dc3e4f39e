"""Columns that are added to the regression of a law."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array, Mask

__all__ = ["AddedColumns"]


class AddedColumns(NamedTuple):
    """Columns that are added to the regression of a law.

    Attributes
    ----------
    names : tuple of str, length k
        What each is of; several may be of the same.
    sensor : ndarray, shape (n, k)
        As the sensor reads it, natural units.
    states : ndarray, shape (n, 2, k)
        Displacement and velocity.
    scale : ndarray, shape (k,)
        Prior sd of the coefficient.
    positive : ndarray of bool, shape (k,)
        Whether it has to be positive.
    """

    names: tuple[str, ...]
    sensor: Array
    states: Array
    scale: Array
    positive: Mask

    @classmethod
    def shown(cls, names: tuple[str, ...], sensor: Array, scale: float | Array) -> AddedColumns:
        """Columns of the recording, shape (n, k), of either sign, which do not affect the motion."""
        n, k = sensor.shape
        return cls(names, sensor, np.zeros((n, 2, k)), np.full(k, scale), np.zeros(k, np.bool_))
