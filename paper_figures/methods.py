"""How each estimator is drawn: a marker, a line and a colour of its own, different in grey too."""

from __future__ import annotations

from typing import Any

__all__ = ["COMPARED_STYLE", "METHOD_STYLE"]

METHOD_STYLE: dict[str, dict[str, Any]] = {
    "waveform": {"color": "#0b4f8a", "ls": "-", "marker": "o"},
    "envelope": {"color": "#009e73", "ls": "--", "marker": "s"},
    "normal-gamma, highest": {"color": "#d55e00", "ls": "-.", "marker": "^"},
    "normal-gamma, nominal": {"color": "#8a5a83", "ls": ":", "marker": "v"},
    "gamma-exponential": {"color": "#777777", "ls": "-", "marker": "x"},
}

COMPARED_STYLE: dict[str, dict[str, Any]] = {
    **{name: style for name, style in METHOD_STYLE.items() if name != "gamma-exponential"},
    "least squares (lmfit)": {"color": "#111111", "ls": ":", "marker": "x"},
    "line on the envelope": {"color": "#111111", "ls": "--", "marker": "D", "mfc": "white"},
    "log decrement": {"color": "#9a9a9a", "ls": "-", "marker": "<"},
    "Feeny-Liang decrement": {"color": "#9a9a9a", "ls": "--", "marker": ">", "mfc": "white"},
}
"""Methods compared with each other; gamma-exponential, which estimates 1/r, would be off every scale."""
