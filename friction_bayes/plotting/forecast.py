"""The part of a record that was held out, as both models forecast it from the part before."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from friction_bayes.core.text import words
from friction_bayes.loop.report.result import RecordTrace
from friction_bayes.plotting.style import ACCENT, DATA, FAINT, MODEL, caption, new_figure, styled

__all__ = ["plot_forecast"]

_BAND = 1.645
"""Standard deviations on either side of a 90 % band."""


def plot_forecast(trace: RecordTrace) -> Figure:
    """Draw the signal held out with both forecasts and the predictive 90 % band, and below the errors.

    Parameters
    ----------
    trace : RecordTrace
        With forecasts.

    Returns
    -------
    matplotlib.figure.Figure
    """
    assert trace.forecasts is not None
    before, ahead = trace.forecasts
    reach = _BAND * ahead.sd
    size = 1.6 if ahead.time.size > 2000 else 3.0
    models = (
        (before.mean, {"color": ACCENT, "lw": 1.1, "ls": (0, (4, 2)), "label": "before"}),
        (ahead.mean, {"color": MODEL, "lw": 1.1, "label": "after"}),
    )
    with styled():
        figure = new_figure(9.0, 5.4)
        upper, lower = figure.subplots(2, 1, sharex=True)
        band = {"color": FAINT, "lw": 0.0, "label": "predictive 90 % band"}
        upper.fill_between(ahead.time, ahead.mean - reach, ahead.mean + reach, **band)
        upper.plot(
            ahead.time, ahead.signal, ".", color=DATA, ms=size, mew=0.0, rasterized=True, label="record"
        )
        lower.fill_between(ahead.time, -reach, reach, **band)
        for forecast, style in models:
            upper.plot(ahead.time, forecast, **style)
            lower.plot(ahead.time, ahead.signal - forecast, **style)
        lower.axhline(0.0, color="#444444", lw=0.6)
        # the Coulomb model may be out of phase: the band and the final model set the scale
        high = 1.15 * max(float(np.max(np.abs(ahead.signal - ahead.mean))), float(np.max(reach)))
        if float(np.max(np.abs(ahead.signal - before.mean))) > 4.0 * high:
            lower.set_ylim(-high, high)
            caption(lower, "before leaves the panel")
        upper.set_title(f"{trace.name}: held out")
        upper.set_ylabel(f"{words(trace.quantity)} [{trace.unit}]")
        lower.set_ylabel(f"record - forecast [{trace.unit}]")
        lower.set_xlabel("time [s]")
        figure.legend(*upper.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure
