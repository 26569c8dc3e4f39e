"""The quantities a sensor measures, their SI units, and the other units that are accepted."""

from __future__ import annotations

import math
from dataclasses import dataclass

from friction_bayes.core.errors import InputError, unknown_name
from friction_bayes.core.unit_spelling import plain_unit

__all__ = [
    "QUANTITIES",
    "STANDARD_GRAVITY",
    "TIME_UNITS",
    "UNCALIBRATED_UNITS",
    "Quantity",
    "inverse_square",
    "known_units",
    "quantity_named",
    "to_si",
]

STANDARD_GRAVITY = 9.80665
"""m/s2, by definition."""


@dataclass(frozen=True)
class Quantity:
    """One measured quantity of a free decay.

    Attributes
    ----------
    name : str
        Value of ``record.attrs["quantity"]``.
    order : int
        Time derivative of displacement: 0, 1 or 2.
    angular : bool
        Whether it belongs to a rotational system.
    unit : str
        SI unit, as in ``record.attrs["units"]``.
    column : str
        Column name in a CSV file.
    """

    name: str
    order: int
    angular: bool
    unit: str
    column: str


QUANTITIES: dict[str, Quantity] = {
    q.name: q
    for q in (
        Quantity("displacement", 0, False, "m", "displacement_m"),
        Quantity("velocity", 1, False, "m/s", "velocity_m_s"),
        Quantity("acceleration", 2, False, "m/s2", "acceleration_m_s2"),
        Quantity("angle", 0, True, "rad", "angle_rad"),
        Quantity("angular_velocity", 1, True, "rad/s", "angular_velocity_rad_s"),
        Quantity("angular_acceleration", 2, True, "rad/s2", "angular_acceleration_rad_s2"),
    )
}

_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "ft": 0.3048}
_ANGLES = {
    "rad": 1.0,
    "mrad": 1e-3,
    "urad": 1e-6,
    "deg": math.pi / 180.0,
    "arcmin": math.pi / 10800.0,
    "arcsec": math.pi / 648000.0,
    "rev": 2.0 * math.pi,
}


def _per(units: dict[str, float], time: str) -> dict[str, float]:
    return {f"{unit}/{time}": factor for unit, factor in units.items()}


# A short table and no library of units: such a library knows a thousand names, and reads ``px`` as 1/96 inch,
# ``ch`` as a surveyor's chain and ``g`` as a gram, where the header of a record means none of them.
_UNITS: dict[str, dict[str, float]] = {
    "m": _LENGTHS,
    "m/s": _per(_LENGTHS, "s"),
    "m/s2": _per(_LENGTHS, "s2") | {"g": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY},
    "rad": _ANGLES,
    "rad/s": _per(_ANGLES, "s") | {"rpm": math.pi / 30.0},
    "rad/s2": _per(_ANGLES, "s2"),
}

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86400.0}
"""Units of a column of times, in seconds."""

UNCALIBRATED_UNITS = ("V", "mV", "counts", "px", "a.u.")
"""Units of a raw sensor signal, the last one arbitrary; friction then comes out in the signal's own units."""


def quantity_named(name: str, *, place: str = "quantity") -> Quantity:
    """Look a quantity up, refusing unknown names with the list of known ones."""
    try:
        return QUANTITIES[name]
    except KeyError:
        raise unknown_name(place, "quantity", name, QUANTITIES) from None


def known_units(quantity: Quantity) -> tuple[str, ...]:
    """Return every unit :func:`to_si` accepts for a quantity, the SI unit first."""
    return (*_UNITS[quantity.unit], *UNCALIBRATED_UNITS)


def to_si(quantity: Quantity, unit: str, *, place: str = "unit") -> tuple[float, str]:
    """Return the factor that brings ``unit``, however spelled, to SI and the unit that results.

    Uncalibrated units (V, mV, counts, px, a.u.) are kept as they are, with factor 1.
    """
    plain = plain_unit(unit)
    if plain in UNCALIBRATED_UNITS:
        return 1.0, plain
    if plain not in _UNITS[quantity.unit]:
        choices = ", ".join(known_units(quantity))
        raise InputError(place, f"unit {unit!r} does not measure {quantity.name}", f"give one of {choices}")
    return _UNITS[quantity.unit][plain], quantity.unit


def inverse_square(unit: str) -> str:
    """Return the unit of a precision, one over a unit squared: ``1/N^2``, ``1/(rad/s)^2``."""
    return f"1/{unit}^2" if unit.isalpha() else f"1/({unit})^2"
