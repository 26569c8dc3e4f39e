"""Open the seal of a record whose force may fluctuate: the law and the force are scored apart."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from experiments.blind.fluctuating import RANDOM_FORCE
from experiments.blind.scoring import score, set_name, widths_off
from experiments.blind.sealed import Truth

__all__ = ["FOUND", "force_score", "other_effects", "without_force"]

FOUND = 0.5
"""Probability from which on a random force counts as found."""


def without_force(report: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Candidates with the probabilities of a set with and without a random force added up."""
    total: dict[str, dict[str, Any]] = {}
    for candidate in report["candidates"]:
        others = [name for name in candidate["effects"] if name != RANDOM_FORCE]
        entry = total.setdefault(set_name(others), {"effects": others, "probability": 0.0})
        entry["probability"] += candidate["probability"]
    return list(total.values())


def other_effects(truth: Truth) -> tuple[str, ...]:
    """Visible effects of a truth, the random force apart."""
    return tuple(name for name in truth.visible if name != RANDOM_FORCE)


def _within(summary: Mapping[str, Any] | None, value: float) -> float:
    if summary is None or summary["interval90"] is None or None in summary["interval90"]:
        return math.nan
    low, high = summary["interval90"]
    return float(low <= value <= high)


def force_score(truth: Truth, report: Mapping[str, Any]) -> dict[str, Any]:
    """Score one report.

    Parameters
    ----------
    truth : Truth
        Of :func:`experiments.blind.fluctuating.draw_fluctuating`.
    report : mapping
        Fields of ``report.json``.

    Returns
    -------
    dict
        That of :func:`experiments.blind.scoring.score` for the other effects and the candidates of
        :func:`without_force`; ``force_probability``; ``force_sd_covered`` and ``correlation_time_covered``
        (by the 90 % intervals; NaN where the report has none, or the record no force), ``force_sd_error``
        (relative); ``band`` (share of held-out samples in the predictive 90 % band, NaN where none is given);
        ``widths_off``, how far the truth lies from friction's mean, in widths of its 90 % interval.
    """
    law = score(other_effects(truth), truth.friction, {**report, "candidates": without_force(report)})
    reported = report["random_force"]
    held_out = report["held_out_error"] or {}
    fluctuates = RANDOM_FORCE in truth.effects
    force = reported if fluctuates and reported is not None else {}
    band = held_out.get("inside90")
    sd = truth.parameters.get("force_sd", math.nan)
    mean = force["sd"]["mean"] if force else None
    return law | {
        "force_probability": math.fsum(
            c["probability"] for c in report["candidates"] if RANDOM_FORCE in c["effects"]
        ),
        "force_sd_covered": _within(force.get("sd"), sd),
        "correlation_time_covered": _within(
            force.get("correlation_time_s"), truth.parameters.get("correlation_time_s", math.nan)
        ),
        "force_sd_error": math.nan if mean is None else abs(mean / sd - 1.0),
        "band": math.nan if band is None else float(band),
        "widths_off": widths_off(report["friction_after"], truth.friction),
    }
