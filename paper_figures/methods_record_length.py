"""All methods on the same synthetic records, by record length."""

from __future__ import annotations

from paper_figures.drawing import main
from paper_figures.method_panels import question_figure

__all__ = ["FIGURE"]

FIGURE = question_figure(
    "record length",
    "length of the record from the release on; a period is 0.63 s",
    "All methods on the same synthetic records, by record length.",
)

if __name__ == "__main__":
    main([FIGURE])
