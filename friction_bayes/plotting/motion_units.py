"""Units of the motion, which is a displacement and its rates whatever the sensor measured."""

from __future__ import annotations

from friction_bayes.core.quantities import quantity_named

__all__ = ["motion_unit"]

_LENGTHS = ("m", "rad")


def motion_unit(quantity: str, unit: str, order: int) -> str:
    """Name the unit of the motion's derivative of the given order, 0 for the displacement itself.

    Parameters
    ----------
    quantity, unit : str
        Of the signal. Of a unit that is not calibrated, such as px, the motion's is made from it.
    order : int
    """
    measured = quantity_named(quantity).order
    length = unit.split("/")[0]
    power = order - measured if length not in _LENGTHS else order
    base = length if length in _LENGTHS else unit
    seconds = f"s{abs(power) if abs(power) > 1 else ''}"
    if power == 0:
        return base
    return f"{base}/{seconds}" if power > 0 else f"{base} {seconds}"
