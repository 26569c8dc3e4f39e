"""Fig. 8: prior and posterior of friction and precision, data set 1."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.joint_figure import DRAWN_PRIOR, prior_and_posterior

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_08",
    results=("shown_records",),
    paper=(
        "prior and posterior for the higher friction: 0.2909 N for a reference of 0.2933 N, precision 5.7 "
        "1/N²."
    ),
    caption=(
        "one run of the twin. Friction is near its reference, with a wide interval, as in the paper; "
        "precision is far larger than 5.7 by either reading, as it scales with one over the mass squared, "
        "which the paper does not state." + DRAWN_PRIOR
    ),
    draw=lambda results: prior_and_posterior(results["shown_records"].sel(case="1")),
)

if __name__ == "__main__":
    main([FIGURE])
