"""Fig. 12: prior and posterior of friction and precision, reduced data set 2."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.joint_figure import DRAWN_PRIOR, prior_and_posterior

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_12",
    results=("shown_records",),
    paper=(
        "prior and posterior for the reduced data set: 0.1643 N for 0.1834 N, precision 32.2 1/N², the "
        "region much wider than on the whole data set."
    ),
    caption=(
        "one run of the twin. The region is wider, as in the paper; five or six amplitudes leave friction "
        "anywhere within some 15 % (highest) or 30 % (nominal)." + DRAWN_PRIOR
    ),
    draw=lambda results: prior_and_posterior(results["shown_records"].sel(case="2-reduced, 1000 Hz")),
)

if __name__ == "__main__":
    main([FIGURE])
