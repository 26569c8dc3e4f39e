"""How each kind of result is shown, by name: results lie below the plots and the texts that show them."""

from __future__ import annotations

from html import escape
from importlib import import_module
from typing import Any, NamedTuple

from friction_bayes.core.errors import InputError
from friction_bayes.core.text import listed

__all__ = ["DISPLAYS", "OVERVIEW", "Display", "Shown", "figure_of", "html_of"]

OVERVIEW = "overview"
"""Name of the figure of a result at a glance."""


class Display(NamedTuple):
    """Functions of a result that show it, each as ``module:name``.

    Attributes
    ----------
    overview : str
        Draws it at a glance.
    figures : str
        Draws all of its figures, by name.
    story : str
        Its lines, label and text.
    """

    overview: str
    figures: str
    story: str


DISPLAYS = {
    "Estimate": Display(
        "friction_bayes.plotting.estimate:plot_estimate",
        "friction_bayes.plotting.estimate:estimate_figures",
        "friction_bayes.report.estimate_story:story_of_estimate",
    ),
    "LoopReport": Display(
        "friction_bayes.plotting.loop:plot_loop",
        "friction_bayes.plotting.loop:loop_figures",
        "friction_bayes.report.story:story_of_loop",
    ),
    "MonitorReport": Display(
        "friction_bayes.plotting.monitor:plot_detection_points",
        "friction_bayes.plotting.monitor:monitor_figures",
        "friction_bayes.report.monitor_story:story_of_monitor",
    ),
}
"""By the name of the result's class."""


class Shown:
    """A result that shows itself."""

    def _repr_html_(self) -> str:
        return html_of(self)

    def plot(self, what: str = OVERVIEW) -> Any:
        """Draw a figure; needs matplotlib.

        Parameters
        ----------
        what : str
            ``overview``, the result at a glance, or one of the figures that the command line writes: ``fit``,
            ``residual``, ``amplitudes``, ``friction`` of an estimate, ``candidates``, ``residual``,
            ``forecast`` and more of a closed loop, ``detection_points``, ``tracking``, ``remaining_life`` of
            monitoring; those of one of several records carry its number, ``residual_2``.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            If there is no such figure; lists those that there are.
        """
        return figure_of(self, what)


def figure_of(result: Any, what: str = OVERVIEW) -> Any:
    """Draw a figure of a result; needs matplotlib, which nothing loads before.

    Raises
    ------
    InputError
        If the result has no figure of that name.
    """
    display = DISPLAYS[type(result).__name__]
    if what == OVERVIEW:
        return _loaded(display.overview)(result)
    figures = _loaded(display.figures)(result)
    if what not in figures:
        names = listed(sorted({OVERVIEW, *figures}), "or")
        raise InputError("what", f"{what!r} is no figure of this {type(result).__name__}", f"give {names}")
    return figures[what]


def html_of(result: Any) -> str:
    """Return a result as a notebook shows it: its lines in a table."""
    rows = "".join(
        f'<tr><th style="text-align:left;vertical-align:top">{escape(label)}</th>'
        f'<td style="text-align:left">{escape(text).replace(chr(10), "<br>")}</td></tr>'
        for label, text in _loaded(DISPLAYS[type(result).__name__].story)(result)
    )
    return f"<table>{rows}</table>"


def _loaded(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
