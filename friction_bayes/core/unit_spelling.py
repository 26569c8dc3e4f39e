"""One spelling of a unit out of those in use: ``°``, ``m/s²``, ``Millimeters``, ``rad s^-1``."""

from __future__ import annotations

import re

__all__ = ["plain_unit"]

_CHARACTERS = str.maketrans(
    {"µ": "u", "μ": "u", "°": "deg", "²": "2", "⁻": "-", "−": "-", "¹": "1", "⋅": "·", "^": None, "*": "·"}
    | dict.fromkeys("()[]")
)

_NAMES = {"meter": "m", "metre": "m", "second": "s", "sec": "s", "radian": "rad", "volt": "V"}
_PREFIXES = {"": "", "centi": "c", "milli": "m", "micro": "u", "nano": "n"}

_SPELLINGS = {
    f"{prefix}{name}{plural}": short + symbol
    for prefix, short in _PREFIXES.items()
    for name, symbol in _NAMES.items()
    for plural in ("", "s")
} | {
    "msec": "ms",
    "usec": "us",
    "millis": "ms",
    "micros": "us",
    "minute": "min",
    "minutes": "min",
    "mins": "min",
    "hour": "h",
    "hours": "h",
    "hr": "h",
    "day": "d",
    "days": "d",
    "micron": "um",
    "microns": "um",
    "inch": "in",
    "inches": "in",
    '"': "in",
    "foot": "ft",
    "feet": "ft",
    "degs": "deg",
    "degree": "deg",
    "degrees": "deg",
    "turn": "rev",
    "turns": "rev",
    "revolutions": "rev",
    "dps": "deg/s",
    "g0": "g",
    "gn": "g",
    "g_n": "g",
    "g's": "g",
    "count": "counts",
    "cts": "counts",
    "pixel": "px",
    "pixels": "px",
    "au": "a.u.",
    "arb. u.": "a.u.",
    "arb. units": "a.u.",
    "arbitrary units": "a.u.",
}

# "m s-2", "rad·s-1", "ms-2": a power of the second with no stroke before it
_NEGATIVE_POWER = re.compile(r"(?P<unit>[^\s·./]+?)[\s·.]*s-(?P<power>[12])")


def plain_unit(text: str) -> str:
    """Spell a unit as :data:`friction_bayes.core.quantities.QUANTITIES` does.

    What is no known spelling is returned as it is, but for the shape of its characters.

    Parameters
    ----------
    text : str
        Such as ``m/s^2``, ``°/s``, ``µm``, ``Degrees``.

    Returns
    -------
    str
        ``m/s2``, ``deg/s``, ``um``, ``deg``.
    """
    # of a time, the date from which it is counted is no part of the unit
    plain = text.partition(" since ")[0].replace("**", "").translate(_CHARACTERS).strip()
    power = _NEGATIVE_POWER.fullmatch(plain)
    if power is not None:
        plain = f"{power['unit']}/s{power['power'].replace('1', '')}"
    words = [_plain_word(word.strip()) for word in plain.replace(" per ", "/").split("/")]
    if words[1:] == ["s", "s"]:
        words[1:] = ["s2"]
    return "/".join(words)


def _plain_word(word: str) -> str:
    """Spell one factor; a digit behind it is its power."""
    stem = word.removesuffix("2")
    plain = _SPELLINGS.get(stem.lower(), stem)
    # capitals alone are a style of writing headers, except for what is a capital itself
    if plain.isupper() and plain != "V":
        plain = plain.lower()
    return plain + word[len(stem) :]
