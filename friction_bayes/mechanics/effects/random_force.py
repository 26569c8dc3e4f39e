r"""A force that fluctuates in addition to the others: an Ornstein-Uhlenbeck process.

Its values a time ``s`` apart are normal with covariance ``sd**2 exp(-|s| / correlation_time)``.
"""

from __future__ import annotations

from friction_bayes.mechanics.effects.effect import Parameter, ProcessEffect
from friction_bayes.mechanics.effects.prior import log_normal

__all__ = ["RANDOM_FORCE"]

RANDOM_FORCE = ProcessEffect(
    name="random_force",
    summary="a force that fluctuates with an exponential correlation",
    parameters=(
        Parameter(
            name="sd",
            unit="N",
            angular_unit="N m",
            low=0.0,
            open_low=True,
            # a hundredth of the spring force at full amplitude: a tenth to all of what friction usually is
            prior=lambda scales: log_normal(0.01 * scales.system.stiffness * scales.amplitude, 1.2),
        ),
        Parameter(
            name="correlation_time",
            unit="s",
            low=0.0,
            open_low=True,
            # a sixth of a period, a hundredth to three of them within two standard deviations
            prior=lambda scales: log_normal(1.0 / scales.system.natural_frequency, 1.4),
        ),
    ),
)
