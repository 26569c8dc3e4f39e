"""Noise in proportion to the signal: a gain that fluctuates from sample to sample.

It adds to that of one size, ``sd^2 = sigma^2 + (signal x share)^2``.
"""

from __future__ import annotations

from friction_bayes.mechanics.effects.effect import GrowingNoiseEffect, Parameter
from friction_bayes.mechanics.effects.prior import log_normal

__all__ = ["PROPORTIONAL_NOISE"]

PROPORTIONAL_NOISE = GrowingNoiseEffect(
    name="proportional_noise",
    summary="noise of variance sigma^2 + (signal x share)^2",
    parameters=(
        Parameter(
            name="share",
            unit="1",
            low=0.0,
            open_low=True,
            # a hundredth of the signal; a two-thousandth to a fifth within two deviations
            prior=lambda scales: log_normal(0.01, 1.5),
        ),
    ),
    grows_with=lambda signal, rate: signal,
)
