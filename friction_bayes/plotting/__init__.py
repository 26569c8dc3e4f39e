"""Figures: they draw what they are given, return a matplotlib figure or its axes, and never estimate.

Those of the paper on one's own data are in :mod:`friction_bayes.plotting.paper`.
"""

from __future__ import annotations

from friction_bayes.plotting.comparison import Interval, plot_estimators
from friction_bayes.plotting.posterior import plot_friction, plot_friction_panels, plot_joint
from friction_bayes.plotting.signal import plot_amplitudes, plot_fit
from friction_bayes.plotting.style import figure_files, save_figure, styled, write_figures

__all__ = [
    "Interval",
    "figure_files",
    "plot_amplitudes",
    "plot_estimators",
    "plot_fit",
    "plot_friction",
    "plot_friction_panels",
    "plot_joint",
    "save_figure",
    "styled",
    "write_figures",
]
