"""What closing the loop leaves in a folder: report, draws, figures and the page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from friction_bayes.core.files import write_json
from friction_bayes.loop import LoopReport
from friction_bayes.plotting import figure_files
from friction_bayes.plotting.loop import loop_figures
from friction_bayes.report.loop import loop_page

__all__ = ["write_loop"]


def write_loop(report: LoopReport, result: Mapping[str, Any], made: Mapping[str, Any], folder: Path) -> None:
    """Write ``report.json``, ``posterior.nc``, the figures as PNG and SVG, and ``report.html``.

    Parameters
    ----------
    report : LoopReport
    result : mapping
        What ``report.json`` holds.
    made : mapping
        The manifest of the run.
    folder : pathlib.Path
    """
    write_json(folder / "report.json", result)
    report.posterior.to_netcdf(folder / "posterior.nc", engine="h5netcdf")
    drawings = {}
    for name, figure in loop_figures(report).items():
        for kind, content in figure_files(figure, ("png", "svg")).items():
            (folder / f"{name}.{kind}").write_bytes(content)
            drawings[name] = content
    page = loop_page(result, [trace.name for trace in report.traces], drawings, made)
    (folder / "report.html").write_text(page, encoding="utf-8")
