"""The figure of each kind of result, by name: results lie below the plots that draw them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

__all__ = ["FIGURES", "figure_of"]

FIGURES = {
    "Estimate": ("friction_bayes.plotting.estimate", "plot_estimate"),
    "LoopReport": ("friction_bayes.plotting.loop", "plot_loop"),
}
"""Module and function that draw a result, by the name of its class."""


def figure_of(result: Any) -> Any:
    """Draw a result; needs matplotlib, which nothing loads before."""
    module, function = FIGURES[type(result).__name__]
    return getattr(import_module(module), function)(result)
