"""Fig. 7: decaying acceleration, acquired and estimated, data set 1, the higher friction."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.response_figure import acquired_and_estimated

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_07",
    results=("shown_records",),
    caption="Fig. 7 of the paper, on synthetic data: acceleration acquired and estimated, data set 1.",
    draw=lambda results: acquired_and_estimated(results["shown_records"].sel(case="1")),
)

if __name__ == "__main__":
    main([FIGURE])
