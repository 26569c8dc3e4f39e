"""PySINDy in weak form, set up for a free decay as a careful user would.

Time is in radians of the oscillation and displacement over its largest, so that terms compare. The velocity,
which nobody measured, is that of a local quintic over half a period. Only the equation of the acceleration is
sought; that of the displacement is known.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.signal import savgol_filter

from friction_bayes.core.arrays import Array
from friction_bayes.decay.free_decay import FreeDecay

__all__ = ["LAW", "LIBRARY", "Coefficients", "WeakForm", "weak_form"]

WINDOW, ORDER = 0.5, 5
"""Length of the local polynomial, in periods, and its order."""
HALF_WIDTH, DOMAINS, POWER = 0.75 * math.pi, 300, 2
"""Half the length of a test function, in radians, how many there are, and of which power."""
PATH = (0.0, *np.geomspace(1e-4, 0.1, 30))
"""Thresholds to choose from, shares of the acceleration."""

Term = Callable[[Array, Array, Array], Array]
Coefficients = dict[str, float]
"""By term."""
DRY = "sign(v)"
LAW = ("x", DRY)
"""Spring and dry friction, in every law."""
LIBRARY: dict[str, Term] = {
    "x": lambda x, v, t: x,
    DRY: lambda x, v, t: np.sign(v),
    "1": lambda x, v, t: np.ones_like(x),
    "v": lambda x, v, t: v,
    "v|v|": lambda x, v, t: v * np.abs(v),
    "x^3": lambda x, v, t: x**3,
    "t sign(v)": lambda x, v, t: t * np.sign(v),
    "exp(-(v/0.1)^2) sign(v)": lambda x, v, t: np.exp(-((v / 0.1) ** 2)) * np.sign(v),
    "exp(-(v/0.3)^2) sign(v)": lambda x, v, t: np.exp(-((v / 0.3) ** 2)) * np.sign(v),
}
"""Forces by name, of displacement, velocity and time from -1/2 to 1/2 over the record."""


@dataclass(frozen=True, eq=False)
class WeakForm:
    """Integrals of a record against test functions.

    Attributes
    ----------
    terms : tuple of str
        Names of the forces.
    columns : ndarray, shape (domains, terms)
        Their integrals.
    acceleration : ndarray, shape (domains,)
        That of the acceleration.
    unit : float
        Force of a dry friction of coefficient minus one.
    independent : float
        How many test functions fit into the record without overlap.
    """

    terms: tuple[str, ...]
    columns: Array
    acceleration: Array
    unit: float
    independent: float

    def of(self, terms: Sequence[str]) -> Coefficients:
        """Least squares on some terms."""
        columns = self.columns[:, [self.terms.index(name) for name in terms]]
        found = np.linalg.lstsq(columns, self.acceleration, rcond=None)[0]
        return dict(zip(terms, found.tolist(), strict=True))

    def criterion(self, coefficients: Coefficients) -> float:
        """Bayesian information criterion, of as many data as there are independent test functions."""
        fitted = sum(each * self.columns[:, self.terms.index(name)] for name, each in coefficients.items())
        misfit = float(np.mean((self.acceleration - fitted) ** 2))
        return self.independent * math.log(misfit) + len(coefficients) * math.log(self.independent)

    def best_subset(self) -> Coefficients:
        """Of all sets of terms with spring and dry friction, the one of the best criterion."""
        rest = [name for name in self.terms if name not in LAW]
        sets = (more for size in range(len(rest) + 1) for more in combinations(rest, size))
        return min((self.of([*LAW, *more]) for more in sets), key=self.criterion)

    def thresholded(self) -> Coefficients:
        """PySINDy's default, sequentially thresholded least squares, at the threshold of the best criterion.

        Columns are of unit length: a term goes whose share of the acceleration is below the threshold.
        """
        import pysindy

        size = float(np.linalg.norm(self.acceleration))
        left = []
        for threshold in PATH:
            optimiser = pysindy.STLSQ(threshold=threshold, alpha=0.0, normalize_columns=True)
            found = size * optimiser.fit(self.columns, self.acceleration[:, None] / size).coef_[0]
            terms = [(name, each) for name, each in zip(self.terms, found.tolist(), strict=True) if each]
            left.append(dict(terms))
        return min((each for each in left if DRY in each), key=self.criterion)

    def friction(self, coefficients: Coefficients) -> float:
        """Friction force of some coefficients."""
        return -coefficients[DRY] * self.unit


def weak_form(decay: FreeDecay, library: Mapping[str, Term]) -> WeakForm:
    """Weak form of the moving part of a displacement record.

    Parameters
    ----------
    decay : FreeDecay
    library : mapping
        Forces by name.
    """
    import pysindy

    step = decay.step * decay.frequency
    window = max(2 * round(0.5 * WINDOW * 2.0 * math.pi / step) + 1, ORDER + 2)
    moving = decay.values - decay.rest_position
    size = float(np.max(np.abs(moving)))
    # a local polynomial at an end is one-sided
    inside = slice(window // 2, moving.size - window // 2)
    x, v = (savgol_filter(moving / size, window, ORDER, deriv=k, delta=step)[inside] for k in (0, 1))
    time = step * np.arange(x.size)
    states = pysindy.AxesArray(np.column_stack([x, v, time / time[-1] - 0.5]), {"ax_time": 0, "ax_coord": 1})
    terms = pysindy.CustomLibrary(library_functions=list(library.values()))
    np.random.seed(1)  # noqa: NPY002 - where PySINDy draws its test functions from
    weak = pysindy.WeakPDELibrary(
        function_library=terms, spatiotemporal_grid=time, H_xt=HALF_WIDTH, K=DOMAINS, p=POWER
    )
    columns = np.asarray(weak.fit([states]).transform([states])[0])
    acceleration = np.asarray(weak.convert_u_dot_integral(states))[:, 1]
    unit = decay.system.stiffness * size * (decay.frequency / decay.system.natural_frequency) ** 2
    independent = float(time[-1]) / (2.0 * HALF_WIDTH)
    return WeakForm(tuple(library), columns, acceleration, unit, independent)
