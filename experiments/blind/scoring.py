"""Open the seal: compare the loop's report on a record with its truth. Pure functions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

__all__ = ["credible_set", "score", "set_name", "widths_off"]

CREDIBLE_MASS = 0.95
KEPT_CANDIDATES = 40


def set_name(effects: Sequence[str]) -> str:
    """One name for a set of effects, whatever their order; ``none`` for the empty set."""
    return "+".join(sorted(effects)) or "none"


def credible_set(candidates: Sequence[Mapping[str, Any]], mass: float = CREDIBLE_MASS) -> list[str]:
    """Names of the fewest, most probable candidates whose probabilities add up to ``mass``.

    Parameters
    ----------
    candidates : sequence of mapping
        ``effects`` and ``probability``, in any order.
    mass : float
        Probability to reach.
    """
    held: list[str] = []
    total = 0.0
    for candidate in sorted(candidates, key=lambda c: -c["probability"]):
        if total >= mass:
            break
        held.append(set_name(candidate["effects"]))
        total += candidate["probability"]
    return held


def _relative_error(estimate: Mapping[str, Any] | None, friction: float) -> float:
    mean = None if estimate is None else estimate["mean"]
    return math.inf if mean is None else abs(mean - friction) / friction


def _covers(estimate: Mapping[str, Any] | None, friction: float) -> bool:
    if estimate is None or estimate["interval90"] is None or None in estimate["interval90"]:
        return False
    low, high = estimate["interval90"]
    return bool(low <= friction <= high)


def widths_off(estimate: Mapping[str, Any] | None, friction: float) -> float:
    """Distance of the truth from the estimate's mean in widths of its 90 % interval."""
    if estimate is None or estimate["mean"] is None or estimate["interval90"] is None:
        return math.inf
    low, high = estimate["interval90"]
    if low is None or high is None or not high > low:
        return math.inf
    return float(abs(estimate["mean"] - friction) / (high - low))


def score(visible: Sequence[str], friction: float, report: Mapping[str, Any]) -> dict[str, Any]:
    """Score one report.

    Parameters
    ----------
    visible : sequence of str
        Effects at work that leave a trace in the measured quantity.
    friction : float
        True sliding friction, in the report's unit.
    report : mapping
        Fields of ``report.json``: ``verdict``, ``candidates``, ``friction_before``, ``friction_after``.

    Returns
    -------
    dict
        ``verdict``, ``said`` (most probable set), ``said_probability``, ``truth_probability``,
        ``truth_rank`` (-1 if never evaluated), ``right``, ``held`` (truth within the 95 % set),
        ``held_sets`` (how many that are), ``error_before`` and ``error_after`` (relative), ``covered``,
        ``relative_width`` of the 90 % interval, ``probabilities`` of the first 40 candidates.

    Raises
    ------
    ValueError
        If the probabilities do not sum to one.
    """
    candidates = sorted(report["candidates"], key=lambda c: -c["probability"])
    total = math.fsum(c["probability"] for c in candidates)
    if not math.isclose(total, 1.0, abs_tol=1e-6):
        raise ValueError(f"probabilities of the candidates sum to {total!r}, not to 1")
    truth = set_name(visible)
    names = [set_name(c["effects"]) for c in candidates]
    rank = names.index(truth) if truth in names else -1
    held = credible_set(candidates)
    after = report["friction_after"]
    covered = _covers(after, friction)
    low, high = after["interval90"] if after is not None and after["interval90"] is not None else (None, None)
    return {
        "verdict": report["verdict"],
        "said": names[0],
        "said_probability": candidates[0]["probability"],
        "truth_probability": candidates[rank]["probability"] if rank >= 0 else 0.0,
        "truth_rank": rank,
        "right": names[0] == truth,
        "held": truth in held,
        "held_sets": len(held),
        "error_before": _relative_error(report["friction_before"], friction),
        "error_after": _relative_error(after, friction),
        "covered": covered,
        "relative_width": math.inf if low is None or high is None else (high - low) / friction,
        "probabilities": [c["probability"] for c in candidates[:KEPT_CANDIDATES]],
    }
