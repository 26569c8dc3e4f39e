"""``python -m paper_figures``: draw every figure that is not up to date, or those named."""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

import paper_figures
from paper_figures.drawing import PaperFigure, main


def all_figures() -> list[PaperFigure]:
    """Return the figure of every script of this folder, those of the paper first."""
    modules = sorted(module.name for module in iter_modules(paper_figures.__path__))
    ordered = sorted(modules, key=lambda name: (not name.startswith("figure_"), name))
    found = [
        getattr(import_module(f"paper_figures.{name}"), "FIGURE", None)
        for name in ordered
        if name != "__main__"
    ]
    return [figure for figure in found if figure is not None]


if __name__ == "__main__":
    main(all_figures())
