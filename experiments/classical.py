"""The textbook's estimators of friction from a free decay, each with the interval its user would quote.

All are given the moving part of a displacement record and return friction as a force. Extremes are the
turning points of :func:`friction_bayes.decay.half_cycles.half_cycles`, least-squares fits to half a period
each: the best that a method of amplitudes can be given. Intervals are those of the least-squares fit that
each method is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal, stats

import friction_bayes as fb
from friction_bayes.core.arrays import Array
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.half_cycles import half_cycles

__all__ = [
    "CLASSICAL",
    "Classical",
    "coulomb_signal",
    "extremes",
    "feeny_liang",
    "fitted_signal",
    "hilbert_envelope",
    "log_decrement",
]


LEAST_SHARE = 0.1
"""Amplitudes below this share of the first are left out of the logarithmic decrement, as is common."""


@dataclass(frozen=True)
class Classical:
    """The result of a classical estimator.

    Attributes
    ----------
    friction : float
        Force [N].
    sd : float
        Its standard error.
    degrees : float
        Of freedom of the Student t that its interval is taken from.
    damping_ratio : float
        Where the method estimates one; nan elsewhere.
    """

    friction: float
    sd: float
    degrees: float
    damping_ratio: float = math.nan

    def interval(self, level: float = 0.9) -> tuple[float, float]:
        """Interval of the given probability."""
        reach = float(stats.t.ppf(0.5 + 0.5 * level, self.degrees)) * self.sd
        return self.friction - reach, self.friction + reach


def _fit(columns: Sequence[Array], y: Array, what: str) -> tuple[Array, Array, float]:
    """Least-squares coefficients of some columns, their covariance, degrees of freedom."""
    design = np.column_stack(columns)
    degrees = y.size - design.shape[1]
    if degrees < 1:
        raise fb.InputError(what, f"{y.size} data for {design.shape[1]} unknowns", "give a longer record")
    coefficients, _, _, _ = np.linalg.lstsq(design, y, rcond=None)
    misfit = y - design @ coefficients
    covariance = np.linalg.inv(design.T @ design) * float(misfit @ misfit) / degrees
    return coefficients, covariance, float(degrees)


def extremes(decay: FreeDecay) -> Array:
    """Successive extremes of the signal, one a half cycle, unit of the signal."""
    cycles = half_cycles(decay)
    if int(cycles.attrs["half_cycles_per_interval"]) != 1:
        raise fb.InputError(decay.name, "turning points are missing", "sample faster")
    return np.asarray(cycles["value"].values, dtype=np.float64)


def log_decrement(found: Array, stiffness: float) -> Classical:
    r"""Logarithmic decrement, and the friction that loses as much energy over the same swings.

    ``ln A_n`` falls by ``delta`` a half cycle, the slope of a line. The method knows viscous damping alone.
    The energy that it takes as lost at amplitude ``A`` is ``delta k A**2`` a half cycle, that of dry friction
    ``2 r A``; their sums over the record are equal for ``r = delta k sum(A**2) / (2 sum(A))``, to first order
    in the loss.

    Parameters
    ----------
    found : ndarray, shape (n,)
        Successive extremes [m].
    stiffness : float
        In N/m.
    """
    # half the way from extreme to extreme: free of the rest position
    amplitude = 0.5 * np.abs(np.diff(found))
    large = np.cumprod(amplitude > LEAST_SHARE * amplitude[0]).astype(bool)
    size = amplitude[large]
    index = np.arange(size.size, dtype=np.float64)
    (slope, _), covariance, degrees = _fit([index, np.ones_like(index)], np.log(size), "log decrement")
    factor = stiffness * float((size**2).sum() / (2.0 * size.sum()))
    ratio = -slope / math.hypot(math.pi, slope)
    return Classical(-slope * factor, math.sqrt(covariance[0, 0]) * factor, degrees, ratio)


def feeny_liang(found: Array, stiffness: float) -> Classical:
    r"""Coulomb and viscous friction from successive extremes (Feeny & Liang, J. Sound Vib. 195, 1996).

    Under both, amplitudes obey ``A_{i+1} = p A_i - (1 + p) r/k``, exactly, with
    ``p = exp(-pi zeta / sqrt(1 - zeta**2))``. Signed extremes ``X_i = c + (-1)**i A_i`` about a rest position
    ``c`` then obey ``X_{i+1} = -p X_i + (1 + p) c + (-1)**i (1 + p) r/k``: a regression of each on the one
    before it, whose slope is biased where that one is noisy.

    Parameters
    ----------
    found : ndarray, shape (n,)
        Successive extremes [m].
    stiffness : float
        In N/m.
    """
    before, after = found[:-1], found[1:]
    side = np.where(np.arange(before.size) % 2 == 0, 1.0, -1.0) * (1.0 if found[0] > found[1] else -1.0)
    columns = [before, np.ones_like(before), side]
    (negative, _, jump), covariance, degrees = _fit(columns, after, "Feeny and Liang")
    p = -negative
    if p <= 0.0:
        raise fb.InputError("Feeny and Liang", f"extremes do not alternate (p = {p:.3g})", "sample longer")
    gradient = np.array([jump / (1.0 + p) ** 2, 0.0, 1.0 / (1.0 + p)])
    sd = math.sqrt(float(gradient @ covariance @ gradient))
    decrement = -math.log(p) / math.pi
    ratio = decrement / math.hypot(1.0, decrement)
    return Classical(jump / (1.0 + p) * stiffness, sd * stiffness, degrees, ratio)


def hilbert_envelope(decay: FreeDecay) -> Classical:
    """A line through the Hilbert envelope; its slope is that of Eq. (2), ``2 r w0 / (pi k)``.

    A half period at either end is left out, where the transform is wrong.
    """
    envelope = np.abs(signal.hilbert(decay.values - decay.rest_position))
    edge = max(round(math.pi / decay.frequency / decay.step), 1)
    inside = slice(edge, envelope.size - edge)
    time = decay.time[inside]
    (slope, _), covariance, degrees = _fit([time, np.ones_like(time)], envelope[inside], "Hilbert envelope")
    factor = decay.system.stiffness * math.pi / (2.0 * decay.frequency)
    return Classical(-slope * factor, math.sqrt(covariance[0, 0]) * factor, degrees)


def coulomb_signal(
    time: Array, amplitude: float, drop: float, rest: float, frequency: float, phase: float
) -> Array:
    """Displacement of a Coulomb decay that has not stopped; the amplitude falls by two drops a half cycle."""
    angle = frequency * time + phase
    half_cycle = np.floor(angle / math.pi)
    side = 1.0 - 2.0 * np.mod(half_cycle, 2.0)
    return rest + (amplitude - (2.0 * half_cycle + 1.0) * drop) * np.cos(angle) + drop * side


def fitted_signal(decay: FreeDecay) -> Classical:
    """Least squares on every sample by lmfit, all five parameters free, with its standard error."""
    import lmfit

    time, values = decay.time, decay.values
    period = max(round(2.0 * math.pi / decay.frequency / decay.step), 2)
    size = float(np.abs(values - decay.rest_position)[:period].max())
    turns = max(decay.frequency * time[-1] / math.pi, 1.0)
    start = {
        "amplitude": size,
        # as if the motion came to rest at the end of the record
        "drop": 0.5 * size / turns,
        "rest": decay.rest_position,
        "frequency": decay.frequency,
        "phase": decay.phase,
    }
    parameters = lmfit.Parameters()
    for name, value in start.items():
        parameters.add(name, value=value)

    def residual(trial: Any) -> Array:
        return values - coulomb_signal(time, **trial.valuesdict())

    found = lmfit.minimize(residual, parameters)
    drop = found.params["drop"]
    if drop.stderr is None or not math.isfinite(drop.stderr):
        raise fb.InputError("lmfit", "gave no standard error", "give a longer record")
    stiffness = decay.system.stiffness
    return Classical(drop.value * stiffness, drop.stderr * stiffness, float(found.nfree))


CLASSICAL: dict[str, Callable[[FreeDecay], Classical]] = {
    "log decrement": lambda decay: log_decrement(extremes(decay), decay.system.stiffness),
    "Feeny-Liang decrement": lambda decay: feeny_liang(extremes(decay), decay.system.stiffness),
    "line on the envelope": hilbert_envelope,
    "least squares (lmfit)": fitted_signal,
}
"""By the label of the tables."""
