"""A part of a posterior, as a sampler samples it and in closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from friction_bayes.conjugate.likelihood import Target

__all__ = ["PosteriorPart"]


@dataclass(frozen=True, eq=False)
class PosteriorPart:
    """One part of a posterior, which a sampler samples by itself.

    Attributes
    ----------
    name : str
        In words.
    probability : float
        Of the part.
    forced : bool
        Whether it has a random force.
    coefficient : frozen scipy.stats distribution or Mixture
        Its closed form for the friction coefficient of the signal.
    build_target : callable, () -> Target
        Makes the part as the sampler sees it.
    """

    name: str
    probability: float
    forced: bool
    coefficient: Any
    build_target: Callable[[], Target]
