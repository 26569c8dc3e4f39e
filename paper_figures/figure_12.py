"""Fig. 12: prior and posterior of friction and precision, reduced data set 2."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.joint_figure import prior_and_posterior

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_12",
    results=("shown_records",),
    caption="Fig. 12 of the paper, on synthetic data: normal-gamma prior and posterior, reduced data set 2.",
    draw=lambda results: prior_and_posterior(results["shown_records"].sel(case="2-reduced, 1000 Hz")),
)

if __name__ == "__main__":
    main([FIGURE])
