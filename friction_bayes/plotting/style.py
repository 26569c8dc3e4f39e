"""The one style of all figures: legible in print at column width and in grey."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter
from numpy.typing import NDArray

from friction_bayes.core.errors import InputError

__all__ = [
    "ACCENT",
    "DATA",
    "FAINT",
    "MODEL",
    "TRUTH",
    "Panels",
    "caption",
    "figure_files",
    "margin_note",
    "new_figure",
    "panels_of",
    "save_figure",
    "styled",
    "write_figures",
]

Panels = NDArray[Any]
"""Axes, from top to bottom."""

# Blue, vermilion and green of Okabe and Ito, distinct to colour-blind readers; in grey print by
# lightness, and by line style where lines cross.
DATA = "#9a9a9a"
FAINT = "#d9d9d9"
MODEL = "#0b4f8a"
ACCENT = "#d55e00"
TRUTH = "#111111"

_STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "axes.edgecolor": "#444444",
    "axes.labelcolor": "#222222",
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-3, 4),
    "xtick.color": "#444444",
    "ytick.color": "#444444",
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "legend.fontsize": 9.0,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "white",
    "lines.linewidth": 1.4,
    "lines.solid_capstyle": "round",
    "savefig.dpi": 160,
    "savefig.facecolor": "white",
    # letters as outlines look the same on every machine; the salt makes equal runs equal
    "svg.fonttype": "path",
    "svg.hashsalt": "friction-bayes",
    "pdf.fonttype": 42,
}


@contextmanager
def styled() -> Iterator[None]:
    """Draw within this context, and nothing outside of it changes."""
    with mpl.rc_context(_STYLE):
        yield


class _Shown(Figure):
    """A figure that a notebook shows, whether pyplot is loaded there or not."""

    def _repr_png_(self) -> bytes:
        file = BytesIO()
        self.savefig(file, format="png", dpi=100)
        return file.getvalue()


def new_figure(width: float = 7.0, height: float = 4.2) -> Figure:
    """Return an empty figure [inch] that no window system knows of."""
    return _Shown(figsize=(width, height), layout="constrained")


def panels_of(axes: Any, count: int, *, height: float) -> Panels:
    """Return the axes given, or those of a new figure, from top to bottom.

    Raises
    ------
    InputError
        If another number of axes is given.
    """
    if axes is None:
        axes = new_figure(7.0, height).subplots(count, 1)
    panels = np.ravel(np.asarray(axes, dtype=object))
    if panels.size != count:
        raise InputError("axes", f"{panels.size} given", f"give {count}, or none for a new figure")
    return panels


def caption(axes: Axes, text: str) -> None:
    """Write a small text above the right end of the axes."""
    axes.set_title(text, loc="right", fontsize=9.0, fontweight="normal", color="#444444")


def margin_note(axes: Axes, text: str, *, place: str = "upper right") -> None:
    """Write a small text into a corner of the axes."""
    vertical, horizontal = place.split()
    axes.annotate(
        text,
        xy=(0.99 if horizontal == "right" else 0.01, 0.98 if vertical == "upper" else 0.02),
        xycoords="axes fraction",
        ha=horizontal,
        va="top" if vertical == "upper" else "bottom",
        fontsize=9.0,
        color="#222222",
        bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": "none", "alpha": 0.8},
    )


_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class _PlainLabels(ScalarFormatter):
    """Tick labels and the power of ten that they share, as plain text.

    To set them as mathematics takes a third of the time in which a figure is drawn.
    """

    def __init__(self) -> None:
        super().__init__(useMathText=False)

    def get_offset(self) -> str:
        shared = str(super().get_offset()).replace("\N{MINUS SIGN}", "-")
        return re.sub("^1e(-?[0-9]+)", lambda power: "×10" + power[1].translate(_SUPERSCRIPT), shared)


def figure_files(figure: Figure, formats: tuple[str, ...]) -> dict[str, bytes]:
    """Return what the file of a figure holds in each format."""
    # A creation date would make equal runs differ.
    dated = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
    # at zlib's own level the pixels take twice as long, for files a tenth smaller
    options: dict[str, dict[str, Any]] = {"png": {"pil_kwargs": {"compress_level": 3}}}
    files = {}
    with styled():
        for axes in figure.axes:
            for axis in (axes.xaxis, axes.yaxis):
                if type(axis.get_major_formatter()) is ScalarFormatter:
                    axis.set_major_formatter(_PlainLabels())
        layout = figure.get_layout_engine()
        if layout is not None:
            # Laid out once for all formats, which takes as long as drawing; with any layout left, savefig
            # draws twice. On one canvas the letters measured for the layout are not measured for PNG again.
            FigureCanvasAgg(figure)
            figure.set_dpi(mpl.rcParams["savefig.dpi"])
            layout.execute(figure)
            figure.set_layout_engine(None)
        for kind in formats:
            file = BytesIO()
            figure.savefig(file, format=kind, metadata=dated.get(kind), **options.get(kind, {}))
            files[kind] = file.getvalue()
    return files


def save_figure(
    figure: Figure, folder: Path, name: str, formats: tuple[str, ...] = ("png", "pdf")
) -> list[str]:
    """Write a figure into ``folder`` in every format and return the file names."""
    files = figure_files(figure, formats)
    for kind, content in files.items():
        (folder / f"{name}.{kind}").write_bytes(content)
    return [f"{name}.{kind}" for kind in files]


def write_figures(figures: Mapping[str, Figure], folder: Path, suffix: str = "") -> dict[str, bytes]:
    """Write figures as PNG and PDF, their names ending in ``suffix``, and return them as SVG by name."""
    drawings = {}
    for name, figure in figures.items():
        files = figure_files(figure, ("png", "pdf", "svg"))
        drawings[name] = files.pop("svg")
        for kind, content in files.items():
            (folder / f"{name}{suffix}.{kind}").write_bytes(content)
    return drawings
