"""Fig. 2: prior and posterior of friction and precision, numerical example of section 3."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.joint_figure import prior_and_posterior

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_02",
    results=("shown_records",),
    caption="Fig. 2 of the paper, on synthetic data: normal-gamma prior and posterior, section 3.",
    draw=lambda results: prior_and_posterior(results["shown_records"].sel(case="example")),
)

if __name__ == "__main__":
    main([FIGURE])
