"""Fig. 2: prior and posterior of friction and precision, numerical example of section 3."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.joint_figure import DRAWN_PRIOR, prior_and_posterior

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_02",
    results=("shown_records",),
    paper=(
        "prior above and posterior below of friction and precision for the example of section 3, by the "
        "normal-gamma pair: 0.0706 N and 34.3 1/N², the 90 % region much smaller than the prior's."
    ),
    caption=(
        "one record of the example, by both readings of a peak; the shading is the posterior by nominal "
        "peaks. The region shrinks as in the paper, and is nearer to its precision by nominal peaks; by the "
        "highest samples precision is several times larger. The friction interval is several times wider "
        "than the errors require." + DRAWN_PRIOR
    ),
    draw=lambda results: prior_and_posterior(results["shown_records"].sel(case="example")),
)

if __name__ == "__main__":
    main([FIGURE])
