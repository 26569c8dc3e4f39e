"""The friction that a loss of amplitude has, and whether friction takes enough of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.statespace.measured_path import MeasuredPath

__all__ = [
    "dry_friction",
    "friction_along",
    "friction_of_loss",
]


def friction_of_loss(turning_points: Array) -> float:
    """Friction over stiffness that alone would explain the loss of amplitude between three turns or more."""
    middle = float(np.mean(0.5 * (turning_points[1:] + turning_points[:-1])))
    amplitudes = np.abs(turning_points - middle)
    order = np.arange(amplitudes.size) - 0.5 * (amplitudes.size - 1)
    slope = -float(order @ amplitudes) / float(order @ order)
    return max(0.5 * slope, 1e-4 * float(amplitudes.max()) / amplitudes.size)


def friction_along(path: MeasuredPath) -> float:
    """Friction over stiffness that alone would explain the loss of amplitude along a motion.

    Of fewer than three turning points it is computed from how fast ``hypot(x, v)`` about their middle falls.
    """
    if path.turning.size > 2:
        return friction_of_loss(path.turning_x)
    amplitude = np.hypot(path.x - float(np.mean(path.turning_x)), path.v)
    # a half cycle loses twice r/k of amplitude
    slope = float(np.polyfit(path.phase, amplitude, 1)[0])
    return max(-0.5 * math.pi * slope, 1e-4 * float(amplitude.max()))


def dry_friction(friction: Array, loss: float, tolerance: float, unit: str) -> dict[str, Any]:
    """Whether dry friction matters: the probability that it takes more than that share of the loss.

    The ``loss`` is the friction that alone would explain that of amplitude, in the ``unit`` of the draws. The
    upper limit is that of the draws that have any: with those that have none it would be zero as soon as
    these are 95 %.
    """
    rubs = friction[friction > 0.0]
    return {
        "probability": float(np.mean(friction > tolerance * loss)),
        "upper95": float(np.quantile(rubs, 0.95)) if rubs.size else 0.0,
        "unit": unit,
    }
