"""What a column's name says: time or a quantity, in which unit, and of which run."""

from __future__ import annotations

import re
from typing import NamedTuple

from friction_bayes.core.quantities import QUANTITIES, TIME_UNITS, UNCALIBRATED_UNITS, Quantity, known_units
from friction_bayes.core.unit_spelling import plain_unit

__all__ = ["Header", "is_magnitude", "read_header", "spelled_quantity", "split_run", "unit_at_end"]

_RUN = re.compile(r"(?P<name>.*\S)\s+Run #(?P<run>\d+)")

# "Angle (deg)", "Angle [deg]", "Angle / (deg)", "a (m/(s^2))"; "Angle / deg", where no blanks would make it a
# path. What begins with a digit is an index, as in MATLAB's Y[0].
_WITH_UNIT = re.compile(
    r"(?P<name>.*?\S)(?:\s*/)?\s*[(\[](?P<unit>[^()\[\]\d](?:[^()\[\]]|\([^()]*\))*)[)\]]"
    r"|(?P<n>.*\S)\s+/\s+(?P<u>\S+)"
)

_SUBJECTS = {
    QUANTITIES[name]: re.compile(rf"(?:{spelled})(?:_?[xyz])?")
    for name, spelled in {
        "displacement": r"displacement|disp|position|pos|distance|dist|deflection|[xyz]",
        "velocity": r"velocity|vel|speed|v",
        "acceleration": r"(?:linear_)?acc\w*?|a|t?gf",
        "angle": r"angle|theta|phi|[θφϕ]",
        "angular_velocity": r"angular_(?:velocity|rate)|gyro(?:scope)?|omega|[ωw]",
        "angular_acceleration": r"angular_acceleration",
    }.items()
}
"""What people call each quantity, along an axis or none."""

_MAGNITUDE = re.compile(r"(?:.*_)?(?:abs|absolute|magnitude|norm|resultant|total)(?:_.*)?|\|.*\||tgf")
"""What people call the length of a vector of three axes."""

_TIMES = {"time", "t", "elapsed_time", "timestamp", "x_value"}
"""The last is LabVIEW's, of a signal over time."""

_CLOCKS = {"seconds", "milliseconds", "microseconds", "millis", "micros"}
"""Times that are named by their unit; the last two are a microcontroller's."""

_WEIGHTS = {"g", "mg"}
"""Units of acceleration that may be grams."""


class Header(NamedTuple):
    """What a column's name says, each None where it does not say it."""

    is_time: bool
    quantity: Quantity | None
    unit: str | None


def read_header(name: str) -> Header:
    """Read the name of a column as programs write it, ``angle_deg``, or people, ``Angle, left (deg)``.

    The quantity is that which the name spells out, or else the only one that the unit measures. A name that
    spells out a quantity which its unit does not measure says neither for certain, and only the unit is read.
    Of a path in the file, and of the member of a struct, the last part is read.
    """
    found = _WITH_UNIT.fullmatch(name.strip())
    if found is None:
        return _quotient(name.strip()) or _path(name.strip())
    unit = plain_unit(found["unit"] or found["u"])
    subject = _subject((found["name"] or found["n"]).split("/")[-1].partition(",")[0])
    if subject in _TIMES:
        return Header(True, None, unit)
    spelled = _spelled(subject)
    if spelled is not None:
        return Header(False, spelled if unit in known_units(spelled) else None, unit)
    # volts are of any quantity
    if unit in UNCALIBRATED_UNITS or unit in _WEIGHTS:
        return Header(False, None, unit)
    return Header(False, next((q for q in QUANTITIES.values() if unit in known_units(q)), None), unit)


def spelled_quantity(name: str) -> Quantity | None:
    """Return the quantity that a name alone spells out, ``ay``, whether it has a unit or not."""
    return _spelled(_subject(_stem(name).partition(",")[0]))


def unit_at_end(name: str, quantity: Quantity) -> str | None:
    """Return the unit of a quantity at the end of a name that does not spell that out, ``laser_mm``."""
    parts = _stem(name).split("_")
    ends = (parts[k:] for k in range(1, len(parts)))
    units = (plain_unit("/".join(end)) for end in ends if end != ["in"])
    return next((unit for unit in units if unit in known_units(quantity)), None)


def is_magnitude(name: str) -> bool:
    """Whether a column is named like the length of a vector, ``Absolute acceleration (m/s^2)``, ``TgF``."""
    return _MAGNITUDE.fullmatch(_subject(_stem(name))) is not None


def _stem(name: str) -> str:
    """Return the last part of a name, without a unit in brackets."""
    found = _WITH_UNIT.fullmatch(name.strip())
    return (name if found is None else found["name"] or found["n"]).split("/")[-1]


def split_run(name: str) -> tuple[str, int | None]:
    """Split ``Angle (rad) Run #3``, as PASCO Capstone writes it, into the name and the number of the run."""
    found = _RUN.fullmatch(name)
    return (name, None) if found is None else (found["name"], int(found["run"]))


def _quotient(name: str) -> Header | None:
    """Read ``t/s`` and ``x/cm``, a symbol over its unit; any other slash is of a path."""
    symbol, _, denominator = name.partition("/")
    subject, unit = _subject(symbol), plain_unit(denominator)
    if subject in _TIMES and unit in TIME_UNITS:
        return Header(True, None, unit)
    spelled = _spelled(subject)
    return Header(False, spelled, unit) if spelled is not None and unit in known_units(spelled) else None


def _path(name: str) -> Header:
    """Read ``run/angle_deg`` and ``log.Out.Time``."""
    last = name.split("/")[-1]
    header = _column_name(last)
    return header if any(header) else _column_name(last.split(".")[-1])


def _column_name(name: str) -> Header:
    """Read ``time``, ``t_ms``, ``millis``, ``angle``, ``disp_mm``, ``angular_velocity_rad_s``, ``gFx``."""
    subject = _subject(name)
    if subject in _TIMES:
        return Header(True, None, None)
    if (clock := subject.removesuffix("()")) in _CLOCKS:
        return Header(True, None, plain_unit(clock))
    if subject in QUANTITIES:
        return Header(False, QUANTITIES[subject], None)
    if re.fullmatch("T?gF[xyz]?", name):
        return Header(False, QUANTITIES["acceleration"], "g")
    parts = name.split("_")
    for k in range(1, len(parts)):
        stem, unit = _subject("_".join(parts[:k])), plain_unit("/".join(parts[k:]))
        if stem in _TIMES and unit in TIME_UNITS:
            return Header(True, None, unit)
        spelled = _spelled(stem)
        # displacement_in is one of two as often as one in inches
        if spelled is not None and unit in known_units(spelled) and parts[k:] != ["in"]:
            return Header(False, spelled, unit)
    return Header(False, None, None)


def _subject(text: str) -> str:
    """Return what a header is about, in small letters and without blanks."""
    return "_".join(text.lower().split())


def _spelled(subject: str) -> Quantity | None:
    return next((q for q, names in _SUBJECTS.items() if names.fullmatch(subject)), None)
