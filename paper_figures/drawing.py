"""What all figures share: how results are read, how a figure is kept, and the panels that several have."""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.sources import why_not_usable
from friction_bayes.core.files import write_json
from friction_bayes.plotting.credible_region import draw_region
from friction_bayes.plotting.style import ACCENT, DATA, FAINT, MODEL, TRUTH, new_figure, save_figure, styled

__all__ = [
    "ACCENT",
    "DATA",
    "FAINT",
    "MODEL",
    "TRUTH",
    "MissingResult",
    "PaperFigure",
    "draw_joint",
    "draw_signal",
    "figures_page",
    "legend_above",
    "legend_right",
    "main",
    "make",
    "new_figure",
    "read_results",
]

SYNTHETIC = "synthetic data"
"""Printed in every figure."""


class MissingResult(Exception):
    """A figure needs a result that is not there, or that other sources computed."""


@dataclass(frozen=True, kw_only=True)
class PaperFigure:
    """One figure.

    Attributes
    ----------
    name : str
        Its files are ``NAME.png`` and ``NAME.pdf``.
    results : tuple of str
        Names of the experiments it reads.
    caption : str
        What it shows, in sentences, with the priors and the number of records.
    draw : callable, (mapping of str to Dataset) -> Figure
        Draws from the results by name.
    paper : str
        What the paper's figure of that number shows, in sentences; empty for one of our own.
    """

    name: str
    results: tuple[str, ...]
    caption: str
    draw: Callable[[Mapping[str, xr.Dataset]], Figure]
    paper: str = ""


def _digest(figure: PaperFigure, results: Path) -> str:
    """Key of all that a figure depends on: its results and the scripts of this folder."""
    digest = hashlib.sha256()
    for name in figure.results:
        if reason := why_not_usable(name, results):
            raise MissingResult(f"{figure.name}: {reason}")
        digest.update((results / f"{name}.nc").read_bytes())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()


def read_results(figure: PaperFigure, results: Path) -> dict[str, xr.Dataset]:
    """Load the results that a figure needs, by name."""
    datasets = {}
    for name in figure.results:
        with xr.open_dataset(results / f"{name}.nc", engine="h5netcdf") as stored:
            datasets[name] = stored.load()
    return datasets


def make(figure: PaperFigure, results: Path, out: Path) -> bool:
    """Draw a figure unless it is there already, made of the same results; return whether it was drawn.

    Parameters
    ----------
    figure : PaperFigure
    results : Path
        Folder with the results.
    out : Path
        Folder for the figures; ``NAME.json`` next to the images says what they were made of.

    Raises
    ------
    MissingResult
        If a result is not there, or is of other sources than these.
    """
    digest = _digest(figure, results)
    record = out / f"{figure.name}.json"
    if record.exists() and (out / f"{figure.name}.png").exists() and (out / f"{figure.name}.pdf").exists():
        if json.loads(record.read_text(encoding="utf-8"))["made_of"] == digest:
            return False
        record.unlink()
    datasets = read_results(figure, results)
    out.mkdir(parents=True, exist_ok=True)
    with styled():
        save_figure(_drawn(figure, datasets), out, figure.name)
    write_json(record, {"made_of": digest, "caption": figure.caption, "results": figure.results})
    return True


def _drawn(figure: PaperFigure, datasets: Mapping[str, xr.Dataset]) -> Figure:
    drawn = figure.draw(datasets)
    drawn.supxlabel(SYNTHETIC, x=0.995, ha="right", fontsize=7.0, color="#666666")
    return drawn


def save_small(figure: PaperFigure, results: Path, folder: Path) -> None:
    """Write a figure as a small PNG, for a page of the documentation."""
    folder.mkdir(parents=True, exist_ok=True)
    _drawn(figure, read_results(figure, results)).savefig(folder / f"{figure.name}.png", dpi=120)


def figures_page(figures: Sequence[PaperFigure]) -> str:
    """Return the page of the documentation with the paper's figures and ours, in Markdown."""
    parts = [
        "# The paper's figures and ours\n",
        "Written by `python -m paper_figures --results archive --docs docs`; do not edit. What the paper's "
        "figures show is taken from its text, which is all that we have. All data of ours are synthetic. The "
        "story is in "
        "[paper.md](paper.md), the numbers are in [paper_comparison.md](paper_comparison.md) and "
        "[experiments.md](experiments.md).\n",
    ]
    for figure in figures:
        if figure.paper:
            title = f"Fig. {int(figure.name.removeprefix('figure_'))}"
            parts.append(
                f"## {title}\n\n![{title} of the paper, ours](figures/{figure.name}.png)\n\n"
                f"*The paper:* {figure.paper}\n\n*Ours:* {figure.caption}\n"
            )
    return "\n".join(parts)


def main(figures: Sequence[PaperFigure], argv: Sequence[str] | None = None) -> None:
    """Make figures from the command line."""
    parser = argparse.ArgumentParser(description="Draw figures from results; what is up to date is kept.")
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("results/figures"), help="default %(default)s")
    known = {figure.name: figure for figure in figures}
    if len(known) > 1:
        parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(known)}; all by default")
    parser.add_argument(
        "--docs", type=Path, metavar="DIR", help="small PNGs and, where all are drawn, their page too"
    )
    options = parser.parse_args(argv)
    chosen = getattr(options, "names", None) or list(known)
    if unknown := [name for name in chosen if name not in known]:
        parser.error(f"no figure {unknown[0]!r}: give some of {', '.join(known)}")
    missing = []
    for name in chosen:
        try:
            drawn = make(known[name], options.results, options.out)
            if options.docs is not None:
                with styled():
                    save_small(known[name], options.results, options.docs / "figures")
        except MissingResult as error:
            missing.append(str(error))
            continue
        print(f"{name}: {'drawn' if drawn else 'kept, nothing it depends on has changed'}", file=sys.stderr)
    if options.docs is not None and len(chosen) == len(known) > 1:
        page = options.docs / "paper_figures.md"
        page.write_text(figures_page(figures), encoding="utf-8")
    if missing:
        parser.exit(2, "".join(f"{line}\n" for line in missing))


def legend_right(axes: Axes) -> None:
    """Put the legend to the right of the axes, where it covers nothing."""
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def legend_above(axes: Axes, columns: int) -> None:
    """Put the legend above the axes, to the right of their title, where it covers nothing."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, borderaxespad=0.2)


def draw_joint(
    axes: Axes,
    shown: xr.Dataset,
    stage: str,
    *,
    truth: float | None = None,
    shade: bool = True,
    style: str = "-",
    colour: str = ACCENT,
    label: str = "90 % region",
) -> None:
    """Draw the joint density of friction and precision with its 90 % region.

    Parameters
    ----------
    axes : Axes
    shown : xarray.Dataset
        One case and one reading of a peak, of the experiment ``shown_records``.
    stage : {"prior", "posterior"}
    truth : float, optional
        Reference friction [N].
    shade : bool
        Whether to shade the density.
    style, colour, label : str
        Of the region's border.
    """
    x, y = shown[f"{stage}_friction"].values, shown[f"{stage}_precision"].values
    density = shown[f"{stage}_density"].values
    level = float(shown[f"level_{stage}"])
    draw_region(axes, x, y, density, level, shade=shade, style=style, colour=colour)
    axes.plot([], [], color=colour, ls=style, lw=1.6, label=label)
    if truth is not None:
        axes.axvline(truth, color=TRUTH, lw=1.2, ls=":", label="reference")
    axes.set_xlabel("friction force r [N]")
    axes.set_ylabel("precision s [1/N²]")


def draw_signal(axes: Axes, shown: xr.Dataset, **style: Any) -> None:
    """Draw the acceleration of a case over time, of the experiment ``shown_records``."""
    axes.plot(shown["time"], shown["signal"], **({"color": DATA, "lw": 1.0, "label": "acquired"} | style))
    axes.set_xlabel("time [s]")
    axes.set_ylabel("acceleration [m/s²]")
