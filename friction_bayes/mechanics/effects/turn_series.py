"""Parameters of a series over the turn of a rotor, ``sum a_n sin n x + b_n cos n x``, n = 1 .. 4."""

from __future__ import annotations

from collections.abc import Callable

from friction_bayes.mechanics.effects.effect import Parameter
from friction_bayes.mechanics.effects.prior import Prior, Scales

__all__ = ["TERMS", "turn_parameters"]

_TIMES_A_TURN = ("once", "twice", "thrice", "four_times")
TERMS = len(_TIMES_A_TURN)
"""Of the series, each a sine and a cosine."""


def turn_parameters(
    prior: Callable[[int, str], Callable[[Scales], Prior]], unit: str, angular_unit: str | None = None
) -> tuple[Parameter, ...]:
    """Sine and cosine of each term, those of n = 1 first, zero where left out.

    Parameters
    ----------
    prior : callable
        Prior of the sine or cosine of term n.
    unit, angular_unit : str
        As a :class:`friction_bayes.mechanics.effects.effect.Parameter` has them.
    """
    return tuple(
        Parameter(
            name=f"{often}_{wave}", unit=unit, angular_unit=angular_unit, default=0.0, prior=prior(n, wave)
        )
        for n, often in enumerate(_TIMES_A_TURN, 1)
        for wave in ("sine", "cosine")
    )
