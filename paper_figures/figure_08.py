"""Fig. 8: prior and posterior of friction and precision, data set 1."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.joint_figure import prior_and_posterior

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_08",
    results=("shown_records",),
    caption="Fig. 8 of the paper, on synthetic data: normal-gamma prior and posterior, data set 1.",
    draw=lambda results: prior_and_posterior(results["shown_records"].sel(case="1")),
)

if __name__ == "__main__":
    main([FIGURE])
