"""What a reader hands over, and the one place where a record is made of it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from friction_bayes.core.arrays import Indices
from friction_bayes.core.checks import positive
from friction_bayes.core.errors import InputError, RecordWarning
from friction_bayes.core.quantities import (
    QUANTITIES,
    TIME_UNITS,
    UNCALIBRATED_UNITS,
    Quantity,
    known_units,
    quantity_named,
    to_si,
)
from friction_bayes.core.text import number, words
from friction_bayes.core.unit_spelling import plain_unit
from friction_bayes.records.clock import in_time_unit
from friction_bayes.records.readers.headers import (
    is_magnitude,
    read_header,
    spelled_quantity,
    split_run,
    unit_at_end,
)
from friction_bayes.records.readers.scale import unit_and_factor
from friction_bayes.records.record import make_record, validate_record, within, without_doubled_times
from friction_bayes.records.starting_over import ticks_going_on

__all__ = ["Column", "Table", "is_time", "meanings", "record_from_table", "times_of"]


@dataclass(frozen=True)
class Column:
    """One channel of a file.

    Attributes
    ----------
    read : callable
        Returns its samples, shape (n,); called only for the columns that are used.
    quantity, unit : str, optional
        What the file says it holds; a column name may say it as well.
    clock : callable, optional
        Returns the channel's own time stamps [s], in formats that have them.
    since : str, optional
        The first of the times of the day that it holds, which are then seconds since.
    rows : ndarray of int, shape (n,), optional
        Row of each sample in a text file; a column may begin later and end earlier than others.
    attrs : mapping
        Further attributes of the record, such as ``synthetic``.
    """

    read: Callable[[], NDArray[Any]]
    quantity: str | None = None
    unit: str | None = None
    clock: Callable[[], NDArray[Any]] | None = None
    since: str | None = None
    rows: Indices | None = None
    attrs: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Table:
    """The one-dimensional numeric channels of a file.

    Attributes
    ----------
    columns : mapping of str to Column
        By name; header-less text has the names "0", "1", ...
    """

    columns: Mapping[str, Column]


def record_from_table(
    table: Table,
    *,
    place: str,
    name: str | None = None,
    quantity: str | None = None,
    unit: str | None = None,
    scale: float | None = None,
    time_column: str | int | None = None,
    signal_column: str | int | None = None,
    sampling_rate: float | None = None,
    run: int | None = None,
    duplicates: str | None = None,
    start: float | None = None,
    end: float | None = None,
) -> xr.DataArray:
    """Choose time and signal, and build and validate the record.

    Parameters are those of :func:`~friction_bayes.read_record`; messages call the file ``place``.

    Raises
    ------
    InputError
        If the choice is not clear, or the record is not usable.
    """
    if sampling_rate is not None and time_column is not None:
        raise InputError(place, "both --time-column and --sampling-rate are given", "give one of them")
    table = _one_run(table, place, run)
    clock_name = _time_name(table, place, time_column)
    signal_name = _signal_name(table, place, signal_column, quantity or _measured_in(unit), clock_name)
    column = table.columns[signal_name]
    kind, unit, factor = _meaning(place, signal_name, column, quantity, unit, scale)
    values = column.read()
    if kind.order and _without_sign(signal_name, values):
        raise _magnitude(table, place, signal_name, kind)
    time_unit = "s"
    if sampling_rate is not None:
        time = np.arange(values.size) / positive("--sampling-rate", sampling_rate)
        clock = f"at the given {sampling_rate:g} Hz"
    elif clock_name is not None and (time_column is not None or column.clock is None):
        if clock_name == signal_name:
            raise InputError(
                place,
                f"column {signal_name!r} is named as the signal and holds the times",
                "name the column of the signal, or give --time-column or --sampling-rate",
            )
        time = times_of(column, table, place, clock_name)
        time_unit = _time_unit(place, clock_name, table.columns[clock_name])
        clock = f"over {_named_clock(place, clock_name, table.columns[clock_name])}"
    elif column.clock is not None:
        time = column.clock()
        clock = "over the times of its channel"
    else:
        raise _headerless(table, place) or InputError(
            place,
            f"no time column among {_listed(table)}",
            "name it time_s, or give --time-column or --sampling-rate",
        )
    chosen = name or column.attrs.get("name") or Path(place).name
    if factor != 1.0:
        # what is too large then is refused like any number that is not finite
        with np.errstate(over="ignore"):
            values = factor * values
    record = make_record(time, values, kind.name, unit=unit, name=chosen)
    record.attrs.update({key: v for key, v in column.attrs.items() if key not in record.attrs})
    record.attrs["read"] = f"{_with_unit(signal_name, unit)} {clock}"
    rows = column.rows
    if duplicates is not None:
        record, first = without_doubled_times(record, duplicates)
        rows = None if rows is None else rows[first]
    kept = within(record, start, end)
    record, rows = record[kept], None if rows is None else rows[kept]
    validate_record(record, rows=rows, time_unit=time_unit)
    if signal_column is not None:
        taken = slice(None) if duplicates is not None else kept
        _warn_of_axes_that_move_more(table, chosen, signal_name, kind, taken, clock_name)
    return record


def times_of(column: Column, table: Table, place: str, clock_name: str) -> NDArray[Any]:
    """Return the time of each sample of a column [s].

    Raises
    ------
    InputError
        If the unit of the time column is not one of time, or it has no time where the column has a sample.
    """
    clock = table.columns[clock_name]
    time = ticks_going_on(clock.read()) * TIME_UNITS[_time_unit(place, clock_name, clock)]
    if clock.rows is None or column.rows is None:
        return time
    missing = column.rows[~np.isin(column.rows, clock.rows)]
    if missing.size:
        raise InputError(
            f"{place}: row {missing[0]}",
            f"column {clock_name}: the cell is empty next to a sample",
            "correct or remove that row",
        )
    return time[np.searchsorted(clock.rows, column.rows)]


def _one_run(table: Table, place: str, run: int | None) -> Table:
    """Return the columns of one run, under names without it, with those of no run."""
    named = {name: split_run(name) for name in table.columns}
    runs = sorted({found for _, found in named.values() if found is not None})
    known = ", ".join(map(str, runs))
    if run is None and len(runs) > 1:
        raise InputError(place, f"holds {len(runs)} runs", f"choose one with --run: {known}")
    if run is not None and not runs:
        raise InputError(place, "no column belongs to a run", "leave out --run")
    if run is not None and run not in runs:
        raise InputError(place, f"there is no run {run}", f"choose one with --run: {known}")
    return Table(
        {
            short: table.columns[name]
            for name, (short, found) in named.items()
            if found is None or run in (None, found)
        }
    )


def _listed(table: Table) -> str:
    names = list(table.columns)
    return ", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")


def _named(table: Table, place: str, option: str, wanted: str | int) -> str:
    """Return the column that an option names, by name or by position counted from zero."""
    key, names = str(wanted), list(table.columns)
    if key in table.columns:
        return key
    if key.isdecimal() and int(key) < len(names):
        return names[int(key)]
    raise InputError(place, f"{option} {key!r} is not there", f"give one of {_listed(table)}")


def _time_name(table: Table, place: str, wanted: str | int | None) -> str | None:
    if wanted is not None:
        return _named(table, place, "--time-column", wanted)
    found = [name for name, column in table.columns.items() if is_time(name, column)]
    found = _outermost(found) or _in_seconds(table)
    elapsed = [name for name in found if table.columns[name].since is None]
    # a stamp next to the seconds of a measurement says when that was
    found = elapsed or found
    if len(found) > 1:
        raise InputError(place, f"several time columns: {', '.join(found)}", "name one with --time-column")
    return found[0] if found else None


def _outermost(names: list[str]) -> list[str]:
    """Those that are no members of a struct, if there are any: the others say more by their place."""
    return [name for name in names if "." not in name] or names


def _in_seconds(table: Table) -> list[str]:
    """Return the one column whose name, in whatever language, gives seconds for its unit, if there is one."""
    units = {name: read_header(name).unit or column.unit for name, column in table.columns.items()}
    # minutes and hours are left out: "min" is as often a minimum, "h" a height
    found = [name for name, unit in units.items() if unit and plain_unit(unit) in {"s", "ms", "us", "ns"}]
    return found if len(found) == 1 else []


def is_time(name: str, column: Column) -> bool:
    """Whether a column holds sample times: by its name and in a known unit, or as times of the day."""
    if column.since is not None:
        return True
    header = read_header(name)
    unit = header.unit or column.unit
    return header.is_time and (unit is None or plain_unit(unit) in TIME_UNITS)


def meanings(table: Table) -> dict[str, str]:
    """Say of each column what its name, or the file, states: quantity and unit; empty where neither does."""
    described = {}
    for name, column in table.columns.items():
        kind, unit = _stated(split_run(name)[0], column)
        what = "time" if is_time(split_run(name)[0], column) else "" if kind is None else words(kind.name)
        described[name] = f"{what} [{unit}]".strip() if unit else what
    return described


def _signal_name(
    table: Table, place: str, wanted: str | int | None, quantity: str | None, clock: str | None
) -> str:
    if wanted is not None:
        return _named(table, place, "--signal-column", wanted)
    others = [name for name in table.columns if name != clock]
    stated = {name: _stated(name, table.columns[name])[0] for name in others}
    found = [name for name, kind in stated.items() if kind and quantity in (None, kind.name)]
    found = _outermost(found)
    signed = [name for name in found if not is_magnitude(name)]
    found = signed or found
    if not found and quantity is not None and len(others) == 1:
        found = others
    if len(found) == 1:
        return found[0]
    if found:
        raise InputError(
            place,
            f"several signals: {_with_movement(table, found)}",
            "name one with --signal-column, of axes the one that moves most",
        )
    for kind in QUANTITIES.values():
        for name in others:
            if name.startswith(f"{kind.name}_"):
                unit, units = name.removeprefix(f"{kind.name}_"), ", ".join(known_units(kind))
                raise InputError(
                    place, f"column {name}: {unit!r} does not measure {kind.name}", f"give one of {units}"
                )
    columns = ", ".join(q.column for q in QUANTITIES.values())
    raise _headerless(table, place) or InputError(
        place,
        f"no column says what was measured among {_listed(table)}",
        f"name it one of {columns}, or give --signal-column, --quantity and --unit",
    )


def _with_movement(table: Table, names: Sequence[str]) -> str:
    """List columns with the standard deviation of each, in the unit of the file."""
    listed = []
    for name in names:
        sd, unit = _standard_deviation(table.columns[name]), _stated(name, table.columns[name])[1]
        moved = "" if sd is None else f" [sd {number(sd, 3)} {unit or ''}".rstrip() + "]"
        listed.append(f"{name}{moved}")
    return ", ".join(listed)


def _standard_deviation(column: Column, taken: slice = slice(None)) -> float | None:
    """How far the samples of a column move about their mean; None where it holds no numbers."""
    try:
        values = np.asarray(column.read(), dtype=np.float64)[taken]
    except (InputError, TypeError, ValueError):
        return None
    values = values[np.isfinite(values)]
    return float(values.std()) if values.size else None


def _warn_of_axes_that_move_more(
    table: Table, record: str, name: str, kind: Quantity, taken: slice, clock: str | None
) -> None:
    """Warn where another column of its quantity, but for the clock, moves more than the one named."""
    alike = {kind, _about(table, name)} - {None}
    own, unit = _movement(table, name, kind, taken)
    others = {
        other: _movement(table, other, kind, taken)
        for other in table.columns
        if other not in (name, clock) and _about(table, other) in alike and not is_magnitude(other)
    }
    sd, most = max(((sd, other) for other, (sd, its) in others.items() if its == unit), default=(0.0, ""))
    # of two sensors that follow the same motion nothing need be said
    if own and float(times := number(sd / own, 2)) > 1.0:
        warnings.warn(
            f"{record}: column {most} moves {times} times as much as {name} (standard deviation): of several "
            "axes of one sensor name the one that moves most, or friction comes out too small",
            RecordWarning,
            stacklevel=4,
        )


def _about(table: Table, name: str) -> Quantity | None:
    """Quantity of a column by the file or by its name, with a unit or without."""
    return _stated(name, table.columns[name])[0] or spelled_quantity(name)


def _movement(table: Table, name: str, kind: Quantity, taken: slice) -> tuple[float, str | None]:
    """Standard deviation of a column, zero where it holds no numbers, and the unit that it is in."""
    sd, unit = _standard_deviation(table.columns[name], taken) or 0.0, _stated(name, table.columns[name])[1]
    if unit not in known_units(kind):
        return sd, unit
    factor, unit = to_si(kind, unit)
    return sd * factor, unit


def _without_sign(name: str, values: NDArray[Any]) -> bool:
    """Whether a column is the length of a vector, by its name and for want of numbers below zero."""
    return is_magnitude(name) and values.dtype.kind in "fiu" and not np.any(values < 0)


def _magnitude(table: Table, place: str, name: str, kind: Quantity) -> InputError:
    """Return what to say of the length of a vector, which does not show which way the motion goes."""
    axes = [
        other
        for other, column in table.columns.items()
        if _stated(other, column)[0] is kind and not is_magnitude(other)
    ]
    return InputError(
        place,
        f"column {name} is the length of a vector, without the sign of the motion",
        "with --signal-column name the axis that moves most: " + _with_movement(table, axes)
        if axes
        else "record the axis of the motion",
    )


def _measured_in(unit: str | None) -> str | None:
    """Name of the one quantity that a unit, or that of a sensitivity, measures; None of others."""
    if unit is None or plain_unit(unit) in UNCALIBRATED_UNITS:
        return None
    raw, _, measured = unit.partition("/")
    plain = plain_unit(measured if plain_unit(raw) in UNCALIBRATED_UNITS else unit)
    found = [kind.name for kind in QUANTITIES.values() if plain in known_units(kind)]
    return found[0] if len(found) == 1 else None


def _headerless(table: Table, place: str) -> InputError | None:
    """Return what to say of text without a header line, whose columns have numbers for names."""
    if not all(name.isdecimal() and column.rows is not None for name, column in table.columns.items()):
        return None
    names = list(table.columns)
    times = "--sampling-rate HZ"
    if len(names) > 1:
        times = f"--time-column {names[0]} --signal-column {names[1]}"
    return InputError(
        place,
        f"there is no header line above the numbers of column {_listed(table)}",
        f"say what they are, as by {times} --quantity displacement --unit m",
    )


def _stated(name: str, column: Column) -> tuple[Quantity | None, str | None]:
    """Return quantity and unit that the file itself or a column's name states."""
    header = read_header(name)
    kind = QUANTITIES.get(column.quantity or "") or header.quantity
    if column.unit is None:
        return kind, header.unit
    return kind or read_header(f"{name} ({column.unit})").quantity, plain_unit(column.unit)


def _meaning(
    place: str, name: str, column: Column, quantity: str | None, unit: str | None, scale: float | None
) -> tuple[Quantity, str, float]:
    """Return quantity, unit and scale of a column, refusing options that contradict the file."""
    kind, stated = _stated(name, column)
    if quantity is not None:
        given = quantity_named(quantity, place="--quantity")
        if kind is not None and given is not kind:
            raise InputError(
                place, f"column {name} holds {kind.name}, --quantity says {given.name}", "give one of them"
            )
        kind = given
    if kind is None and (measured := _measured_in(unit)) is not None:
        kind = quantity_named(measured)
    if kind is None:
        raise InputError(
            place,
            f"column {name!r} does not say what was measured",
            f"give --quantity, one of {', '.join(QUANTITIES)}" + ("" if unit or stated else ", and --unit"),
        )
    if stated is None and unit is None:
        stated = unit_at_end(name, kind)
    return kind, *unit_and_factor(kind, stated, unit, scale, place=place, column=name)


def _time_unit(place: str, name: str, clock: Column) -> str:
    """Return the unit of a time column; seconds where none is stated."""
    if clock.since is not None:
        return "s"
    return in_time_unit(place, f"time column {name}", clock.unit or read_header(name).unit or "s")


def _named_clock(place: str, name: str, clock: Column) -> str:
    """Say which column the times are from, and in which unit."""
    if clock.since is not None:
        return f"{name} [s since {clock.since}]"
    return _with_unit(name, _time_unit(place, name, clock))


def _with_unit(name: str, unit: str) -> str:
    """A column's name with its unit; a name that is a number is that of a column without a header."""
    named = f"column {name}" if name.isdigit() else name
    return named if named.endswith(f"[{unit}]") else f"{named} [{unit}]"
