"""Checks of single arguments, so that every refusal reads alike."""

from __future__ import annotations

import math
import operator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError

__all__ = [
    "finite",
    "finite_array",
    "finite_sample",
    "finite_text",
    "in_range",
    "in_unit",
    "non_negative",
    "not_a_number",
    "positive",
    "probability",
    "real_array",
    "whole",
]


def finite(name: str, value: float) -> float:
    """Return ``value`` as a float, refusing what is not a finite number."""
    try:
        if isinstance(value, str):
            # float would read "10" and not "10 kg" or "1,0": text is read where files and options are
            raise TypeError
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(name, f"{value!r} is not a number", "give a finite number") from None
    if not math.isfinite(number):
        raise InputError(name, f"{number} is not finite", "give a finite number")
    return number


def finite_text(name: str, text: str) -> float:
    """Return the number that a text is, refusing what is not finite."""
    try:
        return finite(name, float(text))
    except ValueError:
        raise InputError(name, not_a_number(text), "give a finite number") from None


def not_a_number(text: str) -> str:
    """Say that a text is no number, and where there is a comma in it how numbers are written."""
    how = ": write a decimal point, and nothing between thousands" if "," in text else ""
    return f"{text!r} is not a number{how}"


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


def probability(name: str, value: float, *, such_as: float = 0.9) -> float:
    """Return ``value`` as a float, refusing what is not strictly between zero and one; 90 may be per cent."""
    number = finite(name, value)
    if not 0.0 < number < 1.0:
        meant = f": did you mean {number / 100.0:g}?" if 1.0 < number < 100.0 else f", such as {such_as:g}"
        raise InputError(name, f"{number:g} is not a probability", f"give a number between 0 and 1{meant}")
    return number


def whole(name: str, value: int, *, least: int = 0) -> int:
    """Return ``value`` as an int, refusing what is no integer or below ``least``."""
    try:
        number = operator.index(value)
    except TypeError:
        number = None
    if number is None or number < least:
        problem = f"{value!r} is not an integer" if number is None else f"{number} is below {least}"
        raise InputError(name, problem, f"give a whole number, {least} or more")
    return number


def real_array(name: str, values: ArrayLike, remedy: str = "give real numbers") -> Array:
    """Return ``values`` as an array of floats, infinite ones and NaN included."""
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(name, f"{str(values)[:40]!r} is not an array of real numbers", remedy) from None


def finite_array(name: str, values: ArrayLike, remedy: str = "give finite real numbers") -> Array:
    """Return ``values`` as an array of floats, refusing the first entry that is not a finite number."""
    array = real_array(name, values, remedy)
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        others = f" and {bad.size - 1} more are not finite" if bad.size > 1 else ""
        raise InputError(name, f"entry {bad[0]} is {array.flat[bad[0]]}{others}", remedy)
    return array


def finite_sample(name: str, values: ArrayLike, remedy: str = "give finite real numbers") -> Array:
    """Return ``values`` as an array of floats, of which there is at least one and each is finite."""
    array = finite_array(name, values, remedy)
    if not array.size:
        raise InputError(name, f"shape {array.shape} holds no numbers", remedy)
    return array


def in_unit(name: str, value: Any, unit: str) -> Any:
    """Return the number of a quantity that converts itself, such as one of pint; anything else as it is."""
    if not hasattr(value, "to") or not hasattr(value, "magnitude"):
        return value
    try:
        return value.to(unit).magnitude
    except Exception as error:
        raise InputError(name, f"{str(value)[:40]} is not in {unit}: {error}", f"give it in {unit}") from None
