"""Fig. 7: decaying acceleration, acquired and estimated, data set 1, the higher friction."""

from __future__ import annotations

from paper_figures.drawing import PaperFigure, main
from paper_figures.response_figure import acquired_and_estimated

__all__ = ["FIGURE"]

FIGURE = PaperFigure(
    name="figure_07",
    results=("shown_records",),
    paper=(
        "acceleration acquired (thick grey) and estimated (blue) for the higher friction: amplitudes fall "
        "linearly, with minor differences in amplitude and period; the jumps of the estimated response "
        "are drowned in the sensor's noise of the acquired one."
    ),
    caption=(
        "the same on one run of the twin: the response of the friction estimated by the highest samples "
        "under the prior as drawn (Fig. 8), and two periods of it enlarged, where the jumps at the turning "
        "points show. How alike the two are over 100 runs is in experiments.md."
    ),
    draw=lambda results: acquired_and_estimated(results["shown_records"].sel(case="1")),
)

if __name__ == "__main__":
    main([FIGURE])
