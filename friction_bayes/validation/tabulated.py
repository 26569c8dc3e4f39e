"""A distribution known only as a function: its density or distribution function, tabulated."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import cumulative_simpson, simpson
from scipy.interpolate import PchipInterpolator

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import real_array
from friction_bayes.core.errors import InputError, unknown_name

__all__ = ["ROUNDED", "Kind", "Tabulated"]

Kind = Literal["density", "cdf"]
"""What a function is."""

ROUNDED = 1e-9
"""By how much rounding may take a probability that was computed out of 0 .. 1."""

_POINTS = 8193
_NEGLIGIBLE = 1e-9
"""Probability that may lie outside the table."""

_LARGEST: dict[Kind, float] = {"density": math.inf, "cdf": 1.0 + ROUNDED}


@dataclass(frozen=True)
class Tabulated:
    """Moments, quantiles and distribution function of a callable.

    Build one with :meth:`of`.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Increasing, evenly spaced points.
    probability : ndarray, shape (n,)
        Distribution function there, from 0 to 1.

    Examples
    --------
    >>> import numpy as np
    >>> normal = Tabulated.of(lambda x: np.exp(-0.5 * x**2), around=(-1.0, 1.0))
    >>> round(normal.std(), 4), round(float(normal.cdf(1.96)), 3)
    (1.0, 0.975)
    """

    x: Array
    probability: Array

    @classmethod
    def of(
        cls,
        function: Callable[[Array], ArrayLike],
        *,
        around: tuple[float, float],
        support: tuple[float, float] = (-math.inf, math.inf),
        kind: Kind = "density",
    ) -> Tabulated:
        """Tabulate a function.

        Parameters
        ----------
        function : callable, (n,) -> (n,)
            A density, which need not be normalised, or a distribution function.
        around : tuple of float
            A range that holds a good part of the probability, such as that of draws; it is widened until
            next to nothing lies outside.
        support : tuple of float
            Where the function may be evaluated.
        kind : {"density", "cdf"}
            What the function is.

        Raises
        ------
        InputError
            If the function is negative, not finite, not vectorised, or its integral does not settle.
        """
        if kind not in get_args(Kind):
            raise unknown_name("kind", "kind", kind, get_args(Kind))
        low, high = max(around[0], support[0]), min(around[1], support[1])
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise InputError(
                "support",
                f"{support} and the draws, from {around[0]:g} to {around[1]:g}, share no finite range",
                "give it as (low, high), with draws that vary within",
            )
        mass = _density_mass if kind == "density" else _cdf_mass
        inside = mass(function, low, high)
        for _ in range(64):
            width = high - low
            wider = max(low - 0.5 * width, support[0]), min(high + 0.5 * width, support[1])
            more = mass(function, *wider)
            settled = wider == (low, high) or more - inside <= _NEGLIGIBLE * more
            low, high, inside = *wider, more
            if settled and inside > 0.0:
                return cls._between(function, low, high, kind)
        raise InputError(
            "expected",
            f"the {kind} does not settle between {low:.6g} and {high:.6g}",
            "give a proper one, and its support",
        )

    @classmethod
    def _between(
        cls, function: Callable[[Array], ArrayLike], low: float, high: float, kind: Kind
    ) -> Tabulated:
        x = np.linspace(low, high, _POINTS)
        values = _values(function, x, kind)
        total = cumulative_simpson(values, x=x, initial=0.0) if kind == "density" else values - values[0]
        if np.any(np.diff(total) < -1e-9 * total[-1]):
            raise InputError("expected", f"the {kind} decreases with x", "give a distribution function")
        return cls(x, np.maximum.accumulate(total) / total[-1])

    def cdf(self, x: ArrayLike) -> Array:
        """Distribution function, any shape."""
        inside = np.clip(np.asarray(x, dtype=np.float64), self.x[0], self.x[-1])
        return np.clip(PchipInterpolator(self.x, self.probability)(inside), 0.0, 1.0)

    def ppf(self, p: ArrayLike) -> Array:
        """Quantile, any shape; p strictly between 0 and 1."""
        rising = np.concatenate([[True], np.diff(self.probability) > 0.0])
        wanted = np.asarray(p, dtype=np.float64)
        return np.asarray(np.interp(wanted, self.probability[rising], self.x[rising]))

    def mean(self) -> float:
        """Mean, by parts: ``high - integral of F``."""
        return float(self.x[-1] - simpson(self.probability, x=self.x))

    def std(self) -> float:
        """Standard deviation, by parts."""
        centred = self.x - self.mean()
        square = centred[-1] ** 2 - simpson(2.0 * centred * self.probability, x=self.x)
        return math.sqrt(max(float(square), 0.0))


def _values(function: Callable[[Array], ArrayLike], x: Array, kind: Kind) -> Array:
    vectorised = f"let the {kind} take an array and return as many values"
    try:
        returned = function(x)
    except Exception as error:
        error.add_note(f"the {kind} was given an array of shape {x.shape}; {vectorised}")
        raise
    values = real_array("expected", returned, vectorised)
    if values.shape != x.shape:
        raise InputError("expected", f"shape {values.shape} came back for {x.shape}", vectorised)
    for wrong, what, remedy in (
        (values < 0.0, "negative", f"give the {kind}, not its logarithm"),
        (~np.isfinite(values), "not finite", "state its support"),
        (values > _LARGEST[kind], "above 1", "give a distribution function"),
    ):
        if np.any(wrong):
            where = f"{values[wrong][0]:.6g} at {x[wrong][0]:.6g}"
            raise InputError("expected", f"the {kind} is {what}, {where}", remedy)
    return values


def _density_mass(function: Callable[[Array], ArrayLike], low: float, high: float) -> float:
    x = np.linspace(low, high, _POINTS)
    return float(simpson(_values(function, x, "density"), x=x))


def _cdf_mass(function: Callable[[Array], ArrayLike], low: float, high: float) -> float:
    ends = _values(function, np.array([low, high]), "cdf")
    return float(ends[1] - ends[0])
