"""What a signal gives only where its sensor was calibrated: forces, and the angles of large swings."""

from __future__ import annotations

from friction_bayes.core.declared_force import ForceFactor, declared_forces, frequencies_disagree
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, Quantity
from friction_bayes.core.system import Oscillator

__all__ = ["force_factor", "force_factors", "friction_unit", "length_unit", "swing_frequency"]


def swing_frequency(system: Oscillator, unit: str) -> float:
    """Natural frequency of a pendulum [rad/s]; zero where amplitudes are taken as those of a linear system.

    Large swings are converted by their angle, which a signal that was not calibrated does not give.
    """
    large_swings = system.pendulum and unit not in UNCALIBRATED_UNITS
    return system.natural_frequency if large_swings else 0.0


def friction_unit(system: Oscillator, unit: str) -> str:
    """Unit of friction: the signal's where it was not calibrated."""
    return unit if unit in UNCALIBRATED_UNITS else system.friction_unit


def length_unit(system: Oscillator, quantity: Quantity, unit: str) -> str:
    """Unit of friction over stiffness, likewise."""
    return unit + ("", " s", " s2")[quantity.order] if unit in UNCALIBRATED_UNITS else system.length_unit


def force_factor(system: Oscillator, quantity: Quantity, unit: str) -> float:
    """Factor from the signal's friction coefficient to the friction force; 1 where it was not calibrated."""
    return 1.0 if unit in UNCALIBRATED_UNITS else system.force_factor(quantity)


def force_factors(
    system: Oscillator, quantity: Quantity, unit: str, frequency: float, frequency_sd: float
) -> tuple[ForceFactor, ...]:
    """Equally probable factors to the friction force, by what the frequency found says of the system.

    As :func:`friction_bayes.core.declared_force.declared_forces`; exactly 1 where the signal was not
    calibrated.
    """
    if unit in UNCALIBRATED_UNITS:
        return (ForceFactor(1.0, 0.0),)
    disagree = bool(frequencies_disagree(system, frequency, frequency_sd))
    return declared_forces(system, quantity, frequency, disagree=disagree)
