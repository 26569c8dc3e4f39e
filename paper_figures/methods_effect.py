"""All methods on the same synthetic records, with an effect that they do not model."""

from __future__ import annotations

from paper_figures.drawing import main
from paper_figures.method_panels import question_figure

__all__ = ["FIGURE"]

FIGURE = question_figure(
    "effect",
    "effect in the record that is in no method's model (Feeny and Liang's has viscous damping)",
    "All methods on the same synthetic records, with an effect that they do not model.",
    joined=False,
)

if __name__ == "__main__":
    main([FIGURE])
