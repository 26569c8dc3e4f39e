"""Fig. 10: prior and posterior of friction and precision, data set 2."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.joint_figure import prior_and_posterior

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_10",
    results=("shown_records",),
    caption="Fig. 10 of the paper, on synthetic data: normal-gamma prior and posterior, data set 2.",
    draw=lambda results: prior_and_posterior(results["shown_records"].sel(case="2")),
)

if __name__ == "__main__":
    main([FIGURE])
