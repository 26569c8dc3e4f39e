"""Fig. 9: decaying acceleration, acquired and estimated, data set 2, the lower friction."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.response_figure import acquired_and_estimated

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_09",
    results=("shown_records",),
    paper=(
        "acceleration acquired and estimated for the lower friction: the decay is longer, the jumps are "
        "smaller."
    ),
    caption=("the same on one run of the twin."),
    draw=lambda results: acquired_and_estimated(results["shown_records"].sel(case="2")),
)

if __name__ == "__main__":
    main([FIGURE])
