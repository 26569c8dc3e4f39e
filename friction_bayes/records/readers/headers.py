"""What a column's name says: time or a quantity, in which unit, and of which run."""

from __future__ import annotations

import re
from typing import NamedTuple

from friction_bayes.core.quantities import QUANTITIES, UNCALIBRATED_UNITS, Quantity, known_units

__all__ = ["TIME_UNITS", "Header", "read_header", "split_run"]

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0}

_RUN = re.compile(r"(?P<name>.*\S)\s+Run #(?P<run>\d+)")

# "Angle (deg)", "Angle [deg]", "Angle / (deg)"; "Angle / deg", where no blanks would make it a path. What
# begins with a digit is an index, as in MATLAB's Y[0].
_WITH_UNIT = re.compile(
    r"(?P<name>.*?\S)(?:\s*/)?\s*[(\[](?P<unit>[^()\[\]\d][^()\[\]]*)[)\]]|(?P<n>.*\S)\s+/\s+(?P<u>\S+)"
)

_SPELLINGS = {"sec": "s", "seconds": "s", "msec": "ms", "degrees": "deg", "radians": "rad"}

_ACCELERATION = re.compile(r"a(cc.*|_.*)?")


class Header(NamedTuple):
    """What a column's name says, each None where it does not say it."""

    is_time: bool
    quantity: Quantity | None
    unit: str | None


def read_header(name: str) -> Header:
    """Read the name of a column as programs write it, ``angle_deg``, or people, ``Angle, left (deg)``.

    The quantity is that which the name spells out, or else the only one that the unit measures. A name that
    spells out a quantity which its unit does not measure says neither for certain, and only the unit is read.
    Of a path in the file the last part is read.
    """
    found = _WITH_UNIT.fullmatch(name.strip())
    if found is None:
        return _column_name(name.strip().split("/")[-1])
    unit = _plain(found["unit"] or found["u"])
    stem = (found["name"] or found["n"]).split("/")[-1].partition(",")[0]
    subject = "_".join(stem.lower().split())
    if subject in ("time", "t"):
        return Header(True, None, unit)
    spelled = QUANTITIES.get(subject)
    if spelled is not None:
        return Header(False, spelled if unit in known_units(spelled) else None, unit)
    # volts are of any quantity, and g may be grams
    if unit in UNCALIBRATED_UNITS or (unit == "g" and not _ACCELERATION.fullmatch(subject)):
        return Header(False, None, unit)
    return Header(False, next((q for q in QUANTITIES.values() if unit in known_units(q)), None), unit)


def split_run(name: str) -> tuple[str, int | None]:
    """Split ``Angle (rad) Run #3``, as PASCO Capstone writes it, into the name and the number of the run."""
    found = _RUN.fullmatch(name)
    return (name, None) if found is None else (found["name"], int(found["run"]))


def _column_name(name: str) -> Header:
    """Read ``time``, ``time_ms``, ``angle``, ``angular_velocity_rad_s``."""
    for quantity in QUANTITIES.values():
        tokens = {unit.replace("/", "_").replace("^", ""): unit for unit in known_units(quantity)}
        if name == quantity.name:
            return Header(False, quantity, None)
        prefix = f"{quantity.name}_"
        if name.startswith(prefix) and name.removeprefix(prefix) in tokens:
            return Header(False, quantity, tokens[name.removeprefix(prefix)])
    stem, _, token = name.partition("_")
    if stem.lower() == "time" and (not token or token in TIME_UNITS):
        return Header(True, None, token or None)
    return Header(False, None, None)


def _plain(unit: str) -> str:
    """Spell a unit as :mod:`friction_bayes.core.quantities` does."""
    plain = unit.strip().replace("²", "2").replace("^2", "2").replace("°", "deg")
    return _SPELLINGS.get(plain, plain)
