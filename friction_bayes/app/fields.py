"""What the page is made of: its fields by name, its texts, and the curve of a record."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from typing import Any

import panel as pn
import xarray as xr
from bokeh.events import Tap
from bokeh.models import Span
from bokeh.plotting import figure

from friction_bayes.app.request import SYSTEMS
from friction_bayes.app.understood import READING, curve
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.core.text import words
from friction_bayes.records.record import DUPLICATES

__all__ = ["STYLE", "choices_of", "columns_table", "drop", "html", "plot", "problem", "reading", "systems"]

STYLE = """
:root { --bokeh-font-size: 15px; --bokeh-base-font: system-ui, "Segoe UI", Helvetica, Arial, sans-serif; }
body { background: #eef1f4; color: #1b1f24; }
"""
"""Of the whole page."""
_TEXTS = """
h1 { font-size: 24px; margin: 10px 0 0; } h2 { font-size: 19px; margin: 14px 0 2px; } p { margin: 4px 0; }
.quiet { color: #545d68; }
.problem { border-left: 4px solid #a33e00; background: #fbf1ea; padding: 8px 14px; }
.answer { border-left: 4px solid #0b4f8a; background: #f0f4f8; padding: 8px 14px; font-size: 19px; }
table { border-collapse: collapse; } th, td { text-align: left; padding: 2px 18px 2px 0; }
th { font-weight: 600; border-bottom: 1px solid #d9dee4; }
pre { background: #f0f4f8; padding: 10px 14px; overflow-x: auto; margin: 4px 0; font-size: 14px; }
iframe { width: 100%; height: 920px; border: 1px solid #d9dee4; }
"""
_PLAIN_NUMBERS = ".bk-spin-btn { display: none !important; }"
"""Arrows by a tenth are of no use to a mass or a time, and have no name for who does not see them."""
_DROPPED = """
[data-filepond-item-state="processing-complete"] .filepond--item-panel { background-color: #14532d; }
.filepond--file-info-sub, .filepond--file-status-sub { opacity: 1 !important; }
"""
_FOUND = "as found"
_WIDTH = 170
_LINE, _LIMIT = "#0b4f8a", "#a33e00"


def html(content: str) -> pn.pane.HTML:
    """Return a text of the page, of escaped parts."""
    return pn.pane.HTML(content, sizing_mode="stretch_width", stylesheets=[_TEXTS])


def problem(text: str) -> str:
    """Write what is wrong, so that it is read out at once; nothing where nothing is."""
    return f'<p class="problem" role="alert">{escape(text)}</p>' if text else ""


def columns_table(columns: Mapping[str, str]) -> str:
    """Write what a file says of its columns; nothing of one without any."""
    rows = "".join(
        f"<tr><td>{escape(name)}</td><td>{escape(what) or '–'}</td></tr>" for name, what in columns.items()
    )
    heading = "<tr><th scope=col>column</th><th scope=col>the file says</th></tr>"
    return f"<table>{heading}{rows}</table>" if rows else ""


def drop(megabytes: int) -> pn.widgets.FileDropper:
    """Return the place where a file is dropped."""
    return pn.widgets.FileDropper(
        multiple=False,
        max_file_size=f"{megabytes}MB",
        previews=[],
        sizing_mode="stretch_width",
        stylesheets=[_DROPPED],
    )


def choices_of(values: Iterable[str], spoken: Callable[[str], str] = str) -> dict[str, str]:
    """Options of a choice, of which the first leaves it to the file."""
    return {_FOUND: "", **{spoken(value): value for value in values}}


def reading() -> dict[str, Any]:
    """Return a field for each of :data:`READING`, empty."""
    choices = {
        "time_column": choices_of(()),
        "signal_column": choices_of(()),
        "quantity": choices_of(QUANTITIES, words),
        "duplicates": choices_of(DUPLICATES),
    }
    units = {"sampling_rate": "Hz", "start": "s", "end": "s"}
    whole = ("run", "skip_rows")
    fields: dict[str, Any] = {}
    for name in READING:
        if name in choices:
            fields[name] = pn.widgets.Select(label=words(name), options=choices[name], width=_WIDTH)
        elif name == "unit":
            fields[name] = pn.widgets.TextInput(label=name, placeholder=_FOUND, width=_WIDTH)
        else:
            kind = pn.widgets.IntInput if name in whole else pn.widgets.FloatInput
            fields[name] = _number(kind, name, units.get(name))
    return fields


def systems() -> dict[str, dict[str, Any]]:
    """Return the fields of each of :data:`SYSTEMS`, empty."""
    return {
        kind: {
            name: _number(pn.widgets.FloatInput, name, unit)
            for name, unit in {**system.fields, **system.optional}.items()
        }
        for kind, system in SYSTEMS.items()
    }


def _number(kind: type, name: str, unit: str | None) -> Any:
    spoken = f"{words(name)} [{unit}]" if unit else words(name)
    return kind(label=spoken, value=None, width=_WIDTH, stylesheets=[_PLAIN_NUMBERS])


def plot(record: xr.DataArray, marks: Sequence[float], clicked: Callable[[float], object]) -> pn.pane.Bokeh:
    """Draw a record with marks in time; a click returns its time.

    Parameters
    ----------
    record : xarray.DataArray
    marks : sequence of float
        [s].
    clicked : callable
        Takes a time [s].
    """
    time, values = curve(record)
    axes = figure(
        height=320,
        sizing_mode="stretch_width",
        tools="box_zoom,reset",
        x_axis_label="time [s]",
        y_axis_label=f"{words(record.attrs['quantity'])} [{record.attrs['units']}]",
    )
    axes.toolbar.logo = None
    axes.line(time, values, color=_LINE, line_width=1.0)
    for at in marks:
        axes.add_layout(Span(location=at, dimension="height", line_color=_LIMIT, line_width=2.0))
    axes.on_event(Tap, lambda event: clicked(event.x))
    return pn.pane.Bokeh(axes, sizing_mode="stretch_width", height=320)
