"""How large a strength or a force may be before a record shows it, everything else of its law being free.

Linearised about a motion. The signal's derivatives are differences of motions; a small random force is
followed through the free oscillator, whose response friction changes at the turning points alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from experiments.blind.prior_drawn import AddedLaw, move, reading

__all__ = ["Seen", "nats_against", "seen"]

Array = NDArray[np.float64]

_DIFFERENCE = 1e-4
_MOST_SAMPLES = 800
"""Of more, every n-th is taken, with less noise to make up for it."""
_STRENGTHS = (
    "friction",
    "damping_ratio",
    "drag",
    "asymmetry",
    "static_excess",
    "relative_change",
    "drift_time",
    "cubic",
    "stiffness_change",
    "friction_tilt",
    "friction_bend",
)
"""Of a law, which an analysis leaves free where they act."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Seen:
    """The samples of a law that a sensor with white noise takes.

    Attributes
    ----------
    law : AddedLaw
    start : tuple of float
        Displacement and velocity.
    order : int
        Derivative that is measured.
    times : ndarray, shape (n,)
    noise_sd : float
        Over the amplitude.
    """

    law: AddedLaw
    start: tuple[float, float]
    order: int
    times: Array
    noise_sd: float

    def signal(self, frequency: float = 1.0) -> Array:
        """Without noise, shape (n,)."""
        motion = move(self.law, self.start, None, np.random.default_rng(0))
        return frequency**self.order * reading(motion, self.order, frequency * self.times)

    @cached_property
    def columns(self) -> Array:
        """Derivatives with respect to start, frequency and the strengths that act, shape (n, p)."""
        h = _DIFFERENCE
        x, v = self.start
        starts = [replace(self, start=start).signal() for start in ((x + h, v), (x, v + h))]
        # a motion that is followed faster would be read beyond its end
        change = np.array([*starts, self.signal(1.0 - h)]) - self.signal()
        acting = [self._derivative(strength) for strength in _STRENGTHS if getattr(self.law, strength)]
        return np.column_stack([*(change / h), *acting])

    def _derivative(self, strength: str) -> Array:
        h = _DIFFERENCE
        law = replace(self.law, **{strength: getattr(self.law, strength) + h})
        return (replace(self, law=law).signal() - self.signal()) / h

    def sd_of(self, strength: str, force: tuple[float, float] | None) -> float:
        """Standard deviation with which the record shows a strength that does not act.

        Parameters
        ----------
        strength : str
            Of the law.
        force : tuple of float or None
            Standard deviation and correlation time of a random force that does.
        """
        columns = np.column_stack([self.columns, self._derivative(strength)])
        covariance = self.noise_sd**2 * np.eye(self.times.size)
        if force is not None:
            covariance += force[0] ** 2 * self.force_covariance(force[1])
        information = columns.T @ np.linalg.solve(covariance, columns)
        return float(np.sqrt(np.linalg.inv(information)[-1, -1]))

    def force_covariance(self, correlation_time: float) -> Array:
        """Of the signal under a random force of unit standard deviation, shape (n, n)."""
        step = float(self.times[1] - self.times[0])
        lag = self.times[:, np.newaxis] - self.times
        waves = (np.sin, np.cos, lambda angle: -np.sin(angle))
        response = step * np.tril(waves[self.order](lag))
        if self.order == 2:
            response += np.eye(self.times.size)
        return np.array(response @ np.exp(-np.abs(lag) / correlation_time) @ response.T)

    def force_variances(self, correlation_time: float) -> Array:
        """What a random force of unit standard deviation adds to the noise, over its variance, shape (n,).

        In directions that start, frequency and strengths leave free.
        """
        basis = np.linalg.qr(self.columns)[0]
        left = np.eye(self.times.size) - basis @ basis.T
        added = left @ self.force_covariance(correlation_time) @ left / self.noise_sd**2
        return np.maximum(np.linalg.eigvalsh(added), 0.0)


def nats_against(sd: float, variances: Array) -> float:
    """Log evidence that a record without a random force is expected to have against one of this size."""
    added = sd**2 * variances
    return 0.5 * float(np.sum(np.log1p(added) - added / (1.0 + added)))


def seen(law: AddedLaw, start: tuple[float, float], order: int, times: Array, noise_sd: float) -> Seen:
    """Samples that show as much as all of ``times``, and no more of them than take a moment."""
    stride = -(-times.size // _MOST_SAMPLES)
    return Seen(law=law, start=start, order=order, times=times[::stride], noise_sd=noise_sd / stride**0.5)
