"""What LabVIEW says of the columns of its text files (.lvm) in two headers above them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from friction_bayes.core.checks import finite_text
from friction_bayes.core.errors import InputError

__all__ = ["completed"]

_END = "***End_of_Header***"
_TIME = "X_Value"


def completed(path: Path, lines: Sequence[str]) -> tuple[Sequence[str], dict[str, str]]:
    """Return the lines with the times that LabVIEW leaves out, and the units of columns by their names.

    Lines of other files are returned as they are, without units.

    Parameters
    ----------
    path : Path
        What messages name.
    lines : sequence of str

    Raises
    ------
    InputError
        If the time of the first sample, or the interval, is no number, or channels have several.
    """
    if not lines or not lines[0].startswith("LabVIEW Measurement"):
        return lines, {}
    ends = [k for k, line in enumerate(lines) if line.startswith(_END)]
    # the header of the file and that of its first segment
    if len(ends) < 2 or ends[1] + 2 >= len(lines):
        return lines, {}
    separator = "," if any(line.startswith("Separator,") for line in lines[: ends[0]]) else "\t"
    stated = {key: cells for key, *cells in (line.split(separator) for line in lines[: ends[1]])}
    top = ends[1] + 1
    # the cells of a header are above those of the columns; that of the time holds the key
    _, *names = lines[top].split(separator)
    units = {name: unit.strip() for name, unit in zip(names, stated.get("Y_Unit_Label", ()), strict=False)}
    units[_TIME] = next(iter(stated.get("X_Unit_Label", ())), "")
    kept = {name.strip(): unit for name, unit in units.items() if unit.strip()}
    if not (lines[top].startswith(_TIME) and lines[top + 1].startswith(separator) and "Delta_X" in stated):
        return lines, kept
    steps = sorted({cell.strip() for cell in stated["Delta_X"]} - {""})
    if len(steps) > 1:
        raise InputError(
            f"{path}: Delta_X",
            f"the channels have several intervals, {' and '.join(steps)}",
            "export the channel that is meant by itself, or with its times (X_Columns)",
        )
    begin, step = (
        finite_text(f"{path}: {key}", stated.get(key, ["0"])[0].strip().replace(",", "."))
        for key in ("X0", "Delta_X")
    )
    mark = next(iter(stated.get("Decimal_Separator", ())), "").strip() or "."
    rows = [
        f"{begin + step * k!r}".replace(".", mark) + line
        for k, line in enumerate(lines[top + 1 :])
        if line.strip()
    ]
    return [*lines[: top + 1], *rows], kept
