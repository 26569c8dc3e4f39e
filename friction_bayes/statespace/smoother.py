"""The measured motion before any law is known, without a noise level set by hand.

All motion except the free oscillation at the reference frequency is due to one Ornstein-Uhlenbeck force.
Its sd and correlation time and the sensor noise follow by maximum likelihood of the same Kalman filter that
the regression uses, with start and rest position as columns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from friction_bayes.core.arrays import Array
from friction_bayes.statespace.kalman import Clock, Whitened, smooth, whiten
from friction_bayes.statespace.response import at_sensor
from friction_bayes.statespace.transition import initial_response

__all__ = ["MOTION_KNOWN_TO", "SmoothedMotion", "first_motion"]

MOTION_KNOWN_TO = 1e-5
"""Noise over amplitude below which the smoothed motion is not exact enough for residuals."""

_LOG_LIMITS = (-12.0, 16.0)
"""Of the logarithms of ``q / sigma`` and ``tau``."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothedMotion:
    """A smoothed motion in natural units.

    Attributes
    ----------
    states : ndarray, shape (n, 3)
        Displacement, velocity and force.
    covariance : ndarray, shape (n, 3, 3)
        Of the states.
    noise : float
        Sensor noise sd.
    force_sd, tau : float
        Of the random force.
    """

    states: Array
    covariance: Array
    noise: float
    force_sd: float
    tau: float

    @property
    def velocity_sd(self) -> Array:
        """Standard deviation of the velocity, shape (n,)."""
        return np.asarray(np.sqrt(self.covariance[:, 1, 1]))

    def at_frequency(self, change: float) -> SmoothedMotion:
        """Velocities in natural units of a reference frequency ``change`` times as high.

        Displacements have no unit of time: those of a law with corrected stiffness are right for a sensor of
        velocity or acceleration too. Force and correlation time, which serve as first guesses, stay.
        """
        unit = np.array([1.0, 1.0 / change, 1.0])
        return replace(self, states=self.states * unit, covariance=self.covariance * np.outer(unit, unit))

    def of_noise(self, noise: float) -> SmoothedMotion:
        """The same in other sensor noise, natural units, by which it is known as much better or worse."""
        return replace(self, covariance=self.covariance * (noise / self.noise) ** 2, noise=noise)

    def midway(self, other: SmoothedMotion) -> SmoothedMotion:
        """The motion in the middle between this and another, of the other's precision."""
        return replace(other, states=0.5 * (self.states + other.states))


def first_motion(signal: Array, clock: Clock, row: Array) -> SmoothedMotion:
    """Smoothed motion of a signal.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        Sensor output in natural units.
    clock : Clock
        Its time stamps.
    row : ndarray, shape (3,)
        From :func:`friction_bayes.statespace.kalman.sensor_row`.
    """
    free = initial_response(clock.phase)
    columns = np.column_stack([at_sensor(free, row), np.ones(signal.size)])
    block = np.column_stack([columns, signal])

    def whitened_at(log_force: Array) -> Whitened:
        ratio, tau = np.exp(np.clip(log_force, *_LOG_LIMITS))
        return whiten(block, clock, row, float(ratio), float(tau))

    def misfit(log_force: Array) -> float:
        whitened = whitened_at(log_force)
        rest = max(_least_squares(whitened.gram)[1], 1e-300)
        return float(0.5 * whitened.used * np.log(rest) + 0.5 * whitened.log_determinant)

    starts = [np.array([size, log_tau]) for size in (-2.0, 1.0, 4.0, 7.0) for log_tau in (-0.5, 1.5)]
    start = min(starts, key=misfit)
    found = minimize(
        misfit,
        start,
        method="Nelder-Mead",
        options={
            "maxfev": 60,
            "xatol": 0.05,
            "fatol": 0.05,
            "initial_simplex": start + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.8]]),
        },
    )
    ratio, tau = (float(each) for each in np.exp(np.clip(found.x, *_LOG_LIMITS)))
    whitened = whitened_at(found.x)
    law, rest = _least_squares(whitened.gram)
    noise = max(
        float(np.sqrt(max(rest, 0.0) / max(whitened.used - law.size, 1))),
        MOTION_KNOWN_TO * float(np.max(np.abs(signal))),
    )
    fluctuation, covariance = smooth((signal - columns @ law)[:, None], clock, row, ratio, tau)
    states = fluctuation[:, :3, 0].copy()
    states[:, :2] += free @ law[:2]
    if row[0] == 1.0:
        # a displacement about another rest position is held there by a constant force
        states[:, 0] += law[2]
        states[:, 2] += law[2]
    return SmoothedMotion(
        states=states,
        covariance=covariance[:, :3, :3] * noise**2,
        noise=noise,
        force_sd=ratio * noise,
        tau=tau,
    )


def _least_squares(gram: Array) -> tuple[Array, float]:
    """Coefficients and sum of squares of a regression, the response last, from its sums."""
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    unit = gram / np.outer(scale, scale)
    law = np.linalg.lstsq(unit[:-1, :-1], unit[:-1, -1], rcond=1e-13)[0]
    rest = unit[-1, -1] - 2.0 * unit[-1, :-1] @ law + law @ unit[:-1, :-1] @ law
    return law * scale[-1] / scale[:-1], float(rest * scale[-1] ** 2)
