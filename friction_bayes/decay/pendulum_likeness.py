r"""Whether a rotation declared with a spring swings as a pendulum does: slower, the farther it swings.

The frequency from each period to the next is regressed on how much slower a pendulum of the same amplitude
swings, :math:`\omega_k = \omega_0 (1 - c\,s(A_k))` with :math:`s(A) \approx A^2/16`: ``c`` is one for a
pendulum, zero for a spring of straight characteristic. Its standard error is by the scatter of the
frequencies, from whatever that comes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.decay.demodulation import demodulate
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.mechanics.pendulum import amplitude_of_fundamental, angle_fundamental, frequency_ratio

__all__ = ["SlowerSwings", "pendulum_notes", "slower_swings"]

_FEWEST = 6
"""Frequencies below which they do not show how they scatter."""
_SURE = 5.0
"""Standard errors by which swings are slower the larger they are."""
_SAME = 3.0
"""Standard errors within which this is as of a pendulum."""
_ABOUT = 0.2
"""Distance of the share from a pendulum's within which it is so whatever the standard error."""


_ROUNDS = 4
"""In which the frequency of small swings converts angular velocities and accelerations to angles."""


class SlowerSwings(NamedTuple):
    """How much slower large swings are than small ones.

    Attributes
    ----------
    share, share_sd : float
        Of what a pendulum's would be slower by, and its standard error.
    largest, smallest : float
        Amplitudes compared, in radians.
    rise : float
        Relative rise of the frequency from the largest to the smallest.
    small_swings : float
        Angular frequency of small ones [rad/s].
    """

    share: float
    share_sd: float
    largest: float
    smallest: float
    rise: float
    small_swings: float

    @property
    def pendulum(self) -> bool:
        """Whether that is as of a pendulum."""
        apart = abs(self.share - 1.0)
        return self.share > _SURE * self.share_sd and apart < max(_SAME * self.share_sd, _ABOUT)


def slower_swings(decay: FreeDecay) -> SlowerSwings | None:
    """Compare frequencies of large and small swings.

    None of what is no angle, of too few periods, and of larger swings than a pendulum's signal can show.
    """
    if not decay.system.angular or not decay.calibrated:
        return None
    decay = decay.on_even_grid()
    omega = decay.frequency
    # windows are half a period apart and a period long: every second shares no sample with the next
    windows = demodulate(decay.values - decay.values.mean(), omega * decay.step)
    centre, inphase, quadrature, _ = (each[::2] for each in windows)
    signal = np.hypot(inphase, quadrature)
    if centre.size <= _FEWEST or not np.all(signal > 0.0):
        return None
    phase = np.unwrap(np.arctan2(quadrature, inphase))
    frequency = omega + np.diff(phase) / (np.diff(centre) * decay.step)
    # the phase of a smaller swing is known less
    weight = 1.0 / np.hypot(1.0 / signal[1:], 1.0 / signal[:-1])
    small = float(frequency.max())
    found = None
    for _ in range(_ROUNDS):
        found = _compared(frequency, weight, signal / small**decay.quantity.order, decay.quantity.order)
        small = found.small_swings
        if not (small > 0.0 and math.isfinite(found.largest)):
            return None
    return found


def pendulum_notes(decay: FreeDecay) -> tuple[str, ...]:
    """Say of a rotation that was declared with a spring that it swings as a pendulum, if it does."""
    found = None if decay.system.pendulum else slower_swings(decay)
    if found is None or not found.pendulum:
        return ()
    return (
        f"{decay.name}: looks like a pendulum: the frequency rises by {100.0 * found.rise:.2g} % while the "
        f"amplitude falls from {found.largest:.2g} to {found.smallest:.2g} rad, {found.share:.2f} ± "
        f"{found.share_sd:.2g} of what a pendulum's does; declare a pendulum (--pendulum, fb.Pendulum), "
        "whose law is that of large swings",
    )


def _compared(frequency: Array, weight: Array, signal: Array, order: int) -> SlowerSwings:
    """Regress the frequencies between periods, shape (n - 1,), on the amplitudes of these, shape (n,).

    ``signal`` is its amplitude over the power ``order`` of the frequency of small swings.
    """
    angle = [angle_fundamental(float(each), order) for each in signal]
    amplitude = np.array([amplitude_of_fundamental(each)[0] for each in angle])
    slower = np.array([1.0 - frequency_ratio(each, 0) for each in angle])
    rows = weight[:, None] * np.column_stack([np.ones(frequency.size), -0.5 * (slower[1:] + slower[:-1])])
    (small, product), *_ = np.linalg.lstsq(rows, weight * frequency)
    left = weight * frequency - rows @ np.array([small, product])
    covariance = float(left @ left) / (frequency.size - 2) * np.linalg.pinv(rows.T @ rows)
    return SlowerSwings(
        share=float(product / small),
        share_sd=math.sqrt(covariance[1, 1]) / float(small),
        largest=float(amplitude.max()),
        smallest=float(amplitude.min()),
        rise=float(product / small) * float(np.ptp(slower)),
        small_swings=float(small),
    )
