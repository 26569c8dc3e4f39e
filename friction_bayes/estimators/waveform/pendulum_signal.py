"""The signal of a pendulum with dry friction and its derivatives, by integrating its motion.

Coefficients are those of :mod:`friction_bayes.estimators.waveform.pendulum_fit`.
"""

from __future__ import annotations

import math
from itertools import combinations_with_replacement

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.mechanics.effects import force_vector
from friction_bayes.mechanics.integrate import propagate

__all__ = ["ANGLE", "CURVED", "FREQUENCY", "FRICTION", "OFFSET", "VELOCITY", "PendulumSignal"]

OFFSET, ANGLE, FRICTION, FREQUENCY, VELOCITY = range(5)
"""Places of the coefficients."""

CURVED = tuple(combinations_with_replacement((ANGLE, FRICTION, FREQUENCY, VELOCITY), 2))
"""Pairs of coefficients whose second derivative is not zero: all but the offset's."""

_RTOL = 1e-11
_DIFFERENCE = 1e-5
"""Step of a derivative, relative to what changes the signal by its own size."""


class PendulumSignal:
    """The signal of a pendulum as a function of its five coefficients."""

    def __init__(self, decay: FreeDecay) -> None:
        self.decay = decay
        self.order = decay.quantity.order
        self.n = decay.values.size
        self.time = decay.time
        self.effects = force_vector({})
        self.amplitude = 0.5 * float(np.ptp(decay.values)) / decay.frequency**self.order

    def motion(self, q: Array, n: int) -> tuple[Array, Array]:
        """Signal over the first ``n`` samples and turning times."""
        each, turns = self._followed(q, n)
        return q[OFFSET] + each[self.order], turns

    def states(self, q: Array) -> Array:
        """Angle and angular velocity in the unit of the signal, natural for the frequency, shape (n, 2)."""
        (x, v, _), _ = self._followed(q, self.n)
        w = q[FREQUENCY]
        return np.column_stack([x * w**self.order, v * w ** (self.order - 1)])

    def _followed(self, q: Array, n: int) -> tuple[tuple[Array, Array, Array], Array]:
        """Angle, velocity and acceleration over the first ``n`` samples, and turning times."""
        w = q[FREQUENCY]
        time = self.time[:n]
        status, x, v, acceleration, turns, _, _ = propagate(
            time,
            q[ANGLE],
            q[VELOCITY],
            q[FRICTION] * w ** (2 - self.order),
            1.0,
            w * w,
            True,
            time[-1],
            self.effects,
            _RTOL,
            self.order,
        )
        if status != 0:
            far = np.full(n, np.inf)
            return (far, far, far), turns
        return (x, v, acceleration), turns

    def signal(self, q: Array, n: int) -> Array:
        """Signal over the first ``n`` samples."""
        return self.motion(q, n)[0]

    def turning_samples(self, q: Array) -> Integers:
        """First sample of every half cycle of the record, zero first, and of the rest."""
        _, turns = self.motion(q, self.n)
        first = np.searchsorted(self.time, turns[turns < self.time[-1]])
        return np.unique(np.concatenate([[0], first]))

    def about_the_bottom(self, q: Array) -> Array:
        """The same motion with angles from the bottom at which it comes to rest, not whole turns away."""
        turns = 2.0 * math.pi * round((self.motion(q, self.n)[0][-1] - q[OFFSET]) / (2.0 * math.pi))
        if self.order > 0 or turns == 0.0:
            return q
        return q + turns * np.array([1.0, -1.0, 0.0, 0.0, 0.0])

    def steps(self, q: Array, n: int) -> Array:
        """Steps of the coefficients that change the signal by equal amounts."""
        half_cycles = max(q[FREQUENCY] * self.time[n - 1] / math.pi, 1.0)
        a, w = self.amplitude, q[FREQUENCY]
        change = [a * w**self.order, a, a * w**self.order / half_cycles, w / half_cycles, a * w]
        return _DIFFERENCE * np.array(change)

    def jacobian(self, q: Array, n: int) -> Array:
        """Derivatives by central differences, shape (n, 5)."""
        out = np.ones((n, q.size))
        for j, h in enumerate(self.steps(q, n)):
            if j != OFFSET:
                shift = np.zeros(q.size)
                shift[j] = h
                (above, turns_above), (below, turns_below) = (
                    self.motion(q + shift, n),
                    self.motion(q - shift, n),
                )
                out[:, j] = (above - below) / (2.0 * h)
                if self.order == 2:
                    out[self._jumped(turns_above, turns_below, n), j] = 0.0
        return out

    def _jumped(self, turns: Array, others: Array, n: int) -> Mask:
        """Samples that lie between the same turning point of two motions, where an acceleration jumps."""
        count = min(turns.size, others.size)
        first, last = np.sort([turns[:count], others[:count]], axis=0)
        time = self.time[:n]
        return np.asarray(
            np.searchsorted(first, time, side="right") != np.searchsorted(last, time, side="right")
        )

    def curvature(self, q: Array, sd: Array) -> Array:
        """Second derivatives of the curved pairs, over distances of twice ``sd``, shape (n, pairs)."""
        out = np.empty((self.n, len(CURVED)))
        unit = 2.0 * np.diag(sd)
        centre = self.signal(q, self.n)
        for column, (i, j) in enumerate(CURVED):
            if i == j:
                ends = self.signal(q + unit[i], self.n) + self.signal(q - unit[i], self.n)
                change = ends - 2.0 * centre
            else:
                like = self.signal(q + unit[i] + unit[j], self.n) + self.signal(q - unit[i] - unit[j], self.n)
                unlike = self.signal(q + unit[i] - unit[j], self.n) + self.signal(
                    q - unit[i] + unit[j], self.n
                )
                change = 0.25 * (like - unlike)
            out[:, column] = change / (unit[i, i] * unit[j, j])
        return out

    def first_guess(self) -> Array:
        """Coefficients from the first period: angle and velocity by integrating or fitting the samples."""
        decay, w = self.decay, self.decay.frequency
        period = min(round(2.0 * math.pi / (w * decay.step)), self.n)
        y = decay.values[:period] - decay.rest_position
        time = self.time[:period]
        if self.order == 0:
            near = time <= max(0.15 * 2.0 * math.pi / w, 3.0 * decay.step)
            slope, angle = np.polynomial.polynomial.polyfit(time[near], y[near], 2)[1::-1]
        elif self.order == 1:
            angle, slope = _integral(y, decay.step)[0], y[0]
        else:
            velocity = _integral(y, decay.step)
            angle, slope = _integral(velocity, decay.step)[0], velocity[0]
        # a swing of amplitude A is slower than small ones by about 1 - A**2/16
        natural = w * (1.0 + min(0.5 * self.amplitude**2, 2.0) / 16.0)
        loss = 0.005 * self.amplitude * natural**self.order
        return np.array([decay.rest_position, angle, loss, natural, slope])


def _integral(y: Array, step: float) -> Array:
    """Running integral over one period, less its mean."""
    total = step * np.cumsum(y - y.mean())
    return np.asarray(total - total.mean())
