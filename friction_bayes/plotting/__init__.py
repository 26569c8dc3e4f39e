"""Figures: they draw what they are given, return a matplotlib figure or its axes, and never estimate."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

from friction_bayes.plotting.comparison import Interval, plot_estimators
from friction_bayes.plotting.posterior import plot_friction, plot_friction_panels, plot_joint
from friction_bayes.plotting.signal import plot_amplitudes, plot_fit, plot_residual
from friction_bayes.plotting.style import figure_files, save_figure, styled, write_figures

if TYPE_CHECKING:
    from friction_bayes.plotting import paper

__all__ = [
    "Interval",
    "figure_files",
    "paper",
    "plot_amplitudes",
    "plot_estimators",
    "plot_fit",
    "plot_friction",
    "plot_friction_panels",
    "plot_joint",
    "plot_residual",
    "save_figure",
    "styled",
    "write_figures",
]


def __getattr__(name: str) -> ModuleType:
    """The paper's figures, which load its models: no other figure does."""
    if name != "paper":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module("friction_bayes.plotting.paper")
