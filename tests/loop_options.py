"""Options of a closed loop as a user leaves them, for tests of what comes behind it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from friction_bayes.loop.data.options import TOLERANCE, LoopOptions


def loop_options(effects: Sequence[str] | None = None, **changed: Any) -> LoopOptions:
    """Options with some effects, all of the catalogue where none are named."""
    usual: dict[str, Any] = {
        "seed": 1,
        "effects": None if effects is None else tuple(effects),
        "exclude": (),
        "noise": "auto",
        "random_force": "auto",
        "varying_friction": False,
        "tolerance": TOLERANCE,
        "check": False,
        "reference_friction": None,
    }
    return LoopOptions(**usual | changed)
