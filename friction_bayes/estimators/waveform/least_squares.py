"""Least squares of a Coulomb decay on the whole signal of many records, and the prior."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.conjugate.regression import NormalInverseGamma
from friction_bayes.conjugate.sufficient_statistics import RegressionStatistics
from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.decay.block_means import amplitude_kept, fill_block_means
from friction_bayes.decay.located import FOUND, Located
from friction_bayes.decay.releases import samples_averaged
from friction_bayes.estimators.waveform.gauss_newton import (
    Penalty,
    fit_waveform,
    leave_out_turns,
    start_waveform,
)
from friction_bayes.estimators.waveform.normal_equations import (
    ADVANCE,
    AMPLITUDE,
    COEFFICIENTS,
    EVENLY,
    FRICTION,
    OFFSET,
    PHASE,
    NormalEquations,
    Samples,
    Signal,
)

__all__ = ["WaveformFits", "fit_waveforms", "prior_of"]

_LEAST_EIGENVALUE = 1e-12
"""Least pivot of the normal equations over their diagonal: smaller ones are rounding."""
_LEAST_AVERAGED = 4
"""Samples in a mean below which fitting means first takes longer than it saves."""
FLAT = 2
"""Frequency and phase, the last two coefficients, never have a prior precision."""


class WaveformFits(NamedTuple):
    """Least-squares fits of many records.

    Attributes
    ----------
    coefficients : ndarray, shape (records, 5)
        See :mod:`friction_bayes.estimators.waveform.normal_equations`; the offset is that of the record as it
        is.
    kappa : ndarray, shape (records,)
        Their constant.
    stop : ndarray of int, shape (records,)
        Number of the turning point where the motion ends.
    normal : ndarray, shape (records, 5, 5)
        ``J'J`` at the optimum.
    gradient : ndarray, shape (records, 5)
        ``J'r`` there.
    misfit : ndarray, shape (records,)
        Sum of squared residuals.
    left_out : ndarray of int, shape (records,)
        Samples of an acceleration that count in none of these sums, as they lie near a turning point.
    found : ndarray of bool, shape (records,)
        Whether a minimum was reached.
    """

    coefficients: Array
    kappa: Array
    stop: Integers
    normal: Array
    gradient: Array
    misfit: Array
    left_out: Integers
    found: Mask

    def linearised(self, counts: ArrayLike, free: slice) -> RegressionStatistics:
        """Regressions on the signals linearised at their optima; what was not found is any regular one.

        Parameters
        ----------
        counts : array_like of int, shape (records,)
            Samples in each moving part.
        free : slice
            The coefficients that are not held.
        """
        used = np.asarray(counts) - self.left_out
        found = self.found
        size = len(range(COEFFICIENTS)[free])
        return RegressionStatistics.of_normal_equations(
            used,
            np.where(found[:, None, None], self.normal[:, free, free], np.eye(size)),
            np.where(found[:, None], self.gradient[:, free], 0.0),
            np.where(found[:, None], self.coefficients[:, free], 0.0),
            np.where(found, self.misfit, 0.0),
        )


def fit_waveforms(
    values: Array,
    located: Located,
    order: int,
    precision: float,
    *,
    rest_known: bool = False,
    places: Array = EVENLY,
) -> WaveformFits:
    """Fit the moving parts of many records.

    Parameters
    ----------
    values : ndarray, shape (records, n)
        Samples.
    located : Located
        From :func:`friction_bayes.decay.location.locate_free_decays`; rows where nothing was found are left
        out.
    order : int
        Derivative order of the signal.
    precision : float
        Prior precision of offset, amplitude and friction coefficient, relative to that of a sample.
    rest_known : bool
        Whether the rest position of ``located`` is known and not to be fitted.
    places : ndarray, shape (n,) or (0,)
        Of the samples of every moving part, see
        :class:`~friction_bayes.estimators.waveform.normal_equations.Samples`.
    """
    records = values.shape[0]
    fits = WaveformFits(
        np.full((records, COEFFICIENTS), np.nan),
        np.zeros(records),
        np.zeros(records, dtype=np.int64),
        np.zeros((records, COEFFICIENTS, COEFFICIENTS)),
        np.zeros((records, COEFFICIENTS)),
        np.full(records, np.nan),
        np.zeros(records, dtype=np.int64),
        np.zeros(records, dtype=np.bool_),
    )
    weight = np.array([math.inf if rest_known else precision, precision, precision, 0.0, 0.0])
    _fit_all(values, places, located, order, weight, fits)
    if order == 2:
        _leave_out_turns(values, places, located, order, weight, fits)
    fits.normal[:] = fits.normal + np.tril(fits.normal, -1).swapaxes(-1, -2)
    fits.found[:] &= _regular(fits.normal)
    return fits


def _regular(normal: Array) -> Mask:
    """Which of the normal equations, shape (records, p, p), determine all coefficients."""
    square = np.diagonal(normal, axis1=1, axis2=2)
    usable: Mask = np.isfinite(normal).all(axis=(1, 2)) & (square.min(axis=1) > 0.0)
    scale = np.sqrt(np.where(usable[:, None], square, 1.0))
    product = scale[:, :, None] * scale[:, None, :]
    correlation = np.where(usable[:, None, None], normal / product, 0.0)
    return np.asarray(np.linalg.eigvalsh(correlation)[:, 0] > _LEAST_EIGENVALUE)


@njit(**KERNEL)
def _fit_all(
    values: Array, places: Array, located: Located, order: int, weight: Array, fits: WaveformFits
) -> None:
    """Fit each record, from its rough rest position on."""
    prior = Penalty(weight, np.zeros(COEFFICIENTS))
    for r in range(values.shape[0]):
        if located.status[r] == FOUND:
            y, p = values[r, located.start[r] : located.stop[r]], np.zeros(COEFFICIENTS)
            p[OFFSET] = located.rest_position[r]
            p[ADVANCE] = located.frequency[r] * 0.5 * (y.size - 1)
            p[PHASE] = located.phase[r] + p[ADVANCE]
            fits.kappa[r] = 2.0 * math.floor(p[PHASE] / math.pi) + 1.0
            signal = Signal(y, Samples(y.size, places), order, fits.kappa[r])
            at = NormalEquations(p, fits.normal[r], fits.gradient[r])
            width, squares, started = samples_averaged(located.frequency[r]), 0.0, False
            if places.size == 0 and order < 2 and width >= _LEAST_AVERAGED:
                squares, started = _fit_means(signal, at, prior, width)
            rough = not started
            if rough:
                squares, started = start_waveform(signal, at, prior)
            if started:
                fitted = fit_waveform(signal, squares, at, prior, rough, not rough)
                fits.misfit[r], fits.stop[r], fits.found[r] = fitted
            for k in range(COEFFICIENTS):
                fits.coefficients[r, k] = p[k]


@njit(**INNER)
def _fit_means(signal: Signal, at: NormalEquations, prior: Penalty, width: int) -> tuple[float, bool]:
    """Fit means of ``width`` samples, into ``at.p``: the samples are then read twice only.

    Returns
    -------
    float, bool
        The sum of squares of the samples, about, and whether the means are fitted.
    """
    n = signal.y.size
    means = np.empty(n // width)
    fill_block_means(signal.y, width, 0.0, means)
    p, middle, end = np.zeros(COEFFICIENTS), 0.5 * (n - 1), 0.5 * (means.size - 1)
    # where the middle of the means lies, and how much longer the samples are
    away, longer = (width * end + 0.5 * (width - 1) - middle) / middle, middle / (width * end)
    p[OFFSET] = at.p[OFFSET]
    p[ADVANCE] = at.p[ADVANCE] / longer
    p[PHASE] = at.p[PHASE] + at.p[ADVANCE] * away
    few = NormalEquations(p, np.zeros((COEFFICIENTS, COEFFICIENTS)), np.zeros(COEFFICIENTS))
    averaged = Signal(means, Samples(means.size, signal.samples.places), signal.order, signal.kappa)
    squares, found = start_waveform(averaged, few, prior)
    if found:
        _, _, found = fit_waveform(averaged, squares, few, prior, found, found)
    if found:
        for a in range(COEFFICIENTS):
            at.p[a] = p[a]
        at.p[ADVANCE] = p[ADVANCE] * longer
        kept = amplitude_kept(2.0 * math.pi * middle / at.p[ADVANCE], width)
        at.p[AMPLITUDE], at.p[FRICTION] = p[AMPLITUDE] / kept, p[FRICTION] / kept
        at.p[PHASE] = p[PHASE] - p[ADVANCE] * longer * away
    return squares * width, found


def _leave_out_turns(
    values: Array, places: Array, located: Located, order: int, weight: Array, fits: WaveformFits
) -> None:
    """Repeat the fits of :func:`_fit_all` without samples near the turning points."""
    for r in np.flatnonzero(fits.found):
        y = values[r, located.start[r] : located.stop[r]]
        signal = Signal(y, Samples(y.size, places), order, fits.kappa[r])
        at = NormalEquations(fits.coefficients[r], fits.normal[r], fits.gradient[r])
        prior = Penalty(weight, np.zeros(COEFFICIENTS))
        fits.misfit[r], fits.left_out[r], fits.found[r] = leave_out_turns(signal, at, fits.stop[r], prior)


def prior_of(prior: Mapping[str, float], size: int) -> NormalInverseGamma:
    """Prior of ``size`` coefficients, the last two of them flat, and all where they have no precision.

    In a normal-inverse-gamma a coefficient's scale goes with the error's. Flat coefficients have none, which
    costs the shape one half each, so that the error variance has the given prior.
    """
    precision = np.full(size, float(prior["coefficient_precision"]))
    precision[-FLAT:] = 0.0
    alpha = prior["alpha"] - 0.5 * np.count_nonzero(precision == 0.0)
    return NormalInverseGamma.from_prior(
        mean=np.zeros(size), precision=precision, alpha=alpha, beta=prior["beta"]
    )
