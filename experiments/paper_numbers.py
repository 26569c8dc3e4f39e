"""Every number that the paper prints, from the one table ``paper_numbers.toml``."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

__all__ = ["PaperNumber", "paper_numbers", "printed"]

_KEYS = {"experiment", "variable", "where", "factor", "size", "power", "readings", "per", "share"}

_KINDS = ("result", "input", "criterion")

TABLE = Path(__file__).with_name("paper_numbers.toml")


@dataclass(frozen=True, kw_only=True)
class PaperNumber:
    """One number of the paper.

    Attributes
    ----------
    id : str
        Unique.
    value : float
        As printed, in ``unit``.
    unit : str
    place : str
        Table, figure or section.
    text : str
        The paper's sentence that contains it; empty for a cell of a table.
    kind : {"result", "input", "criterion"}
        Computed by the paper's procedure from its data; what the data are; what the paper judges by.
    restates : str
        Identity of the number that a result follows from, or that it repeats; empty for one of its own.
    scales_with : str
        Quantity that the paper does not state and that ours goes with a power of; empty for none.
    ours : mapping or None
        Where ours is found: ``experiment``, ``variable``, ``where`` (coordinates), ``factor`` to the unit,
        ``size`` (whether the sign is dropped), ``power``, ``readings`` (methods, one row each), ``per``
        (coordinates of what it is divided by), ``share`` (whether it is a share of records). None for an
        input that is taken over.
    note : str
        What a reader must know of the row.
    """

    id: str
    value: float
    unit: str
    place: str
    kind: str
    text: str = ""
    restates: str = ""
    scales_with: str = ""
    ours: Mapping[str, Any] | None = None
    note: str = ""

    def __post_init__(self) -> None:
        if self.ours is not None and (unknown := set(self.ours) - _KEYS):
            raise ValueError(f"{TABLE.name}, {self.id}: unknown {', '.join(sorted(unknown))}")
        if self.kind not in _KINDS:
            raise ValueError(
                f"{TABLE.name}, {self.id}: unknown kind {self.kind!r}, not of {', '.join(_KINDS)}"
            )


@cache
def paper_numbers() -> Mapping[str, PaperNumber]:
    """Return the table by id, in its order.

    Raises
    ------
    ValueError
        If an id occurs twice or an entry has an unknown key.
    """
    found: dict[str, PaperNumber] = {}
    for entry in tomllib.loads(TABLE.read_text(encoding="utf-8"))["number"]:
        if entry["id"] in found:
            raise ValueError(f"{TABLE.name}: {entry['id']} occurs twice")
        found[entry["id"]] = PaperNumber(**entry)
    return MappingProxyType(found)


def printed(identity: str) -> float:
    """Return the paper's number of that id, in the unit of the table."""
    return paper_numbers()[identity].value
