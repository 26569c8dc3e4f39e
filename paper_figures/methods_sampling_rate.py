"""All methods on the same synthetic records, by sampling rate."""

from __future__ import annotations

from paper_figures.drawing import main
from paper_figures.method_panels import question_figure

__all__ = ["FIGURE"]

FIGURE = question_figure(
    "sampling rate",
    "sampling rate; the natural frequency is 1.6 Hz",
    "All methods on the same synthetic records, by sampling rate.",
)

if __name__ == "__main__":
    main([FIGURE])
