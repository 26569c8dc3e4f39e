"""Checks of single arguments, so that every refusal reads alike."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError

__all__ = ["finite", "finite_array", "in_range", "non_negative", "positive", "probability"]


def finite(name: str, value: float) -> float:
    """Return ``value`` as a float, refusing what is not a finite number."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(name, f"{value!r} is not a number", "give a finite number") from None
    if not math.isfinite(number):
        raise InputError(name, f"{number} is not finite", "give a finite number")
    return number


def positive(name: str, value: float) -> float:
    """Return ``value`` as a float, refusing zero and below."""
    number = finite(name, value)
    if number <= 0.0:
        raise InputError(name, f"{number:g} is not positive", "give a number above zero")
    return number


def non_negative(name: str, value: float) -> float:
    """Return ``value`` as a float, refusing negative numbers."""
    number = finite(name, value)
    if number < 0.0:
        raise InputError(name, f"{number:g} is negative", "give zero or a positive number")
    return number


def in_range(name: str, value: float, low: float, high: float) -> float:
    """Return ``value`` as a float, refusing what lies outside ``[low, high]``."""
    number = finite(name, value)
    if not low <= number <= high:
        raise InputError(name, f"{number:g} lies outside {low:g} .. {high:g}", "give a number in that range")
    return number


def probability(name: str, value: float) -> float:
    """Return ``value`` as a float, refusing what is not strictly between zero and one."""
    number = finite(name, value)
    if not 0.0 < number < 1.0:
        raise InputError(
            name, f"{number:g} is not a probability", "give a number between 0 and 1, such as 0.9"
        )
    return number


def finite_array(name: str, values: ArrayLike, remedy: str = "give finite real numbers") -> Array:
    """Return ``values`` as an array of floats, refusing the first entry that is not a finite number."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(name, f"{str(values)[:40]!r} is not an array of real numbers", remedy) from None
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        others = f" and {bad.size - 1} more are not finite" if bad.size > 1 else ""
        raise InputError(name, f"entry {bad[0]} is {array.flat[bad[0]]}{others}", remedy)
    return array
