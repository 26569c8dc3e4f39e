"""What a signal gives only where its sensor was calibrated: forces, and the angles of large swings."""

from __future__ import annotations

from friction_bayes.core.quantities import UNCALIBRATED_UNITS, Quantity
from friction_bayes.core.system import Oscillator

__all__ = ["force_factor", "force_factor_relative_sd", "swing_frequency"]


def swing_frequency(system: Oscillator, unit: str) -> float:
    """Natural frequency of a pendulum [rad/s]; zero where amplitudes are taken as those of a linear system.

    Large swings are converted by their angle, which a signal that was not calibrated does not give.
    """
    large_swings = system.pendulum and unit not in UNCALIBRATED_UNITS
    return system.natural_frequency if large_swings else 0.0


def force_factor(system: Oscillator, quantity: Quantity, unit: str) -> float:
    """Factor from the signal's friction coefficient to the friction force; 1 where it was not calibrated."""
    return 1.0 if unit in UNCALIBRATED_UNITS else system.force_factor(quantity)


def force_factor_relative_sd(system: Oscillator, quantity: Quantity, unit: str) -> float:
    """Relative standard deviation of :func:`force_factor` from that of mass and stiffness."""
    return 0.0 if unit in UNCALIBRATED_UNITS else system.force_factor_relative_sd(quantity)
