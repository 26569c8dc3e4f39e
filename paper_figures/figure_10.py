"""Fig. 10: prior and posterior of friction and precision, data set 2."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.joint_figure import DRAWN_PRIOR, prior_and_posterior

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_10",
    results=("shown_records",),
    paper=(
        "prior and posterior for the lower friction: 0.1808 N for 0.1834 N, precision 11.6 1/N², twice "
        "that of the higher friction."
    ),
    caption=(
        "one run of the twin. Friction is near its reference; precision is far larger than 11.6 by either "
        "reading." + DRAWN_PRIOR
    ),
    draw=lambda results: prior_and_posterior(results["shown_records"].sel(case="2")),
)

if __name__ == "__main__":
    main([FIGURE])
