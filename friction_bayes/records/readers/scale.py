"""The unit of a signal and what a number of its file means, by the file, ``--unit`` and ``--scale``."""

from __future__ import annotations

from friction_bayes.core.checks import finite
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, Quantity, known_units, to_si
from friction_bayes.core.unit_spelling import plain_unit

__all__ = ["unit_and_factor"]

_VOLTS = {"V": 1.0, "mV": 1e-3}


def unit_and_factor(
    kind: Quantity, stated: str | None, unit: str | None, scale: float | None, *, place: str, column: str
) -> tuple[str, float]:
    """Return the unit of a signal, and the factor that brings the numbers of its file to that unit.

    A plain unit takes the numbers times ``scale``; a sensitivity, such as 100 mV/g or 651.9 counts/rad,
    divides by it.

    Parameters
    ----------
    kind : Quantity
        What was measured.
    stated : str, optional
        Unit by the file itself or the name of the column.
    unit : str, optional
        Unit as the user gives it: of the quantity, or of a sensitivity.
    scale : float, optional
        The factor, or the sensitivity.
    place, column : str
        What messages call the file and the signal.

    Raises
    ------
    InputError
        If no unit is read or given, if two contradict each other, or one measures something else.
    """
    units = ", ".join(known_units(kind))
    if scale is not None and finite("--scale", scale) == 0.0:
        raise InputError("--scale", "is zero", "give the unit of the signal per number in the file")
    given = None if unit is None else plain_unit(unit)
    if unit is not None and given not in known_units(kind):
        raw, stroke, measured = unit.partition("/")
        raw, measured = plain_unit(raw), plain_unit(measured)
        if stroke and raw in UNCALIBRATED_UNITS and measured in known_units(kind):
            if stated not in (None, raw) and not {stated, raw} <= _VOLTS.keys():
                raise InputError(
                    place, f"column {column!r} is in {stated}, --unit says {unit}", "give one of them"
                )
            if scale is None:
                raise InputError(
                    "--unit", f"{unit} is a sensitivity", f"give its number with --scale, in {unit}"
                )
            return measured, (_VOLTS[stated] / _VOLTS[raw] if stated in _VOLTS else 1.0) / scale
        given = unit
    chosen = given or stated
    if chosen is None:
        raise InputError(place, f"column {column!r} does not say its unit", f"give --unit, one of {units}")
    if chosen not in known_units(kind):
        raise InputError(
            place,
            f"column {column!r} is in {chosen}, which does not measure {kind.name}",
            f"give --unit, one of {units}",
        )
    calibrated = scale is not None and stated in UNCALIBRATED_UNITS
    # what is in brackets may be no unit at all: there the option has the word
    if stated in known_units(kind) and not calibrated and to_si(kind, chosen) != to_si(kind, stated):
        remedy = "give --scale too" if stated in UNCALIBRATED_UNITS else "give one of them"
        raise InputError(place, f"column {column!r} is in {stated}, --unit says {unit}", remedy)
    return chosen, 1.0 if scale is None else scale
