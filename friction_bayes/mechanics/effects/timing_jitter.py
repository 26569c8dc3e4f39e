"""Sample times that jitter: a sample is early or late, and shows the signal of that moment.

It is noise in proportion to the rate of the signal, ``sd^2 = sigma^2 + (rate x jitter)^2``.
"""

from __future__ import annotations

from friction_bayes.mechanics.effects.effect import GrowingNoiseEffect, Parameter
from friction_bayes.mechanics.effects.prior import log_normal

__all__ = ["TIMING_JITTER"]


TIMING_JITTER = GrowingNoiseEffect(
    name="timing_jitter",
    summary="noise of variance sigma^2 + (rate of the signal x jitter)^2",
    parameters=(
        Parameter(
            name="sd",
            unit="s",
            low=0.0,
            open_low=True,
            # a hundredth of the sampling interval; a two-thousandth to a fifth within two deviations
            prior=lambda scales: log_normal(0.01 / scales.sampling_rate, 1.5),
        ),
    ),
    grows_with=lambda signal, rate: rate,
)
