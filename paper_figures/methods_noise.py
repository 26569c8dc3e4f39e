"""All methods on the same synthetic records, by noise."""

from __future__ import annotations

from paper_figures.drawing import main
from paper_figures.method_panels import question_figure

__all__ = ["FIGURE"]

FIGURE = question_figure(
    "noise",
    "standard deviation of the noise of a sample",
    "All methods on the same synthetic records, by noise.",
)

if __name__ == "__main__":
    main([FIGURE])
