"""Sequential updating over detection points: the posterior of one is the prior of the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, Self, TypeVar

__all__ = ["sequential_update"]


class _ConjugatePair(Protocol):
    def update(self, *data: Any) -> Self: ...


Pair = TypeVar("Pair", bound=_ConjugatePair)


def sequential_update(prior: Pair, *data: Sequence[Any]) -> tuple[Pair, ...]:
    """Update a conjugate pair at detection points T1, T2, ... Tn in order.

    The last posterior equals, to rounding, that of one update with all data together: nothing is forgotten.

    Parameters
    ----------
    prior : NormalGamma, GammaExponential or NormalInverseGamma
        Prior of the first detection point.
    *data : sequence
        One sequence per argument of ``prior.update``, one entry per detection point, as with :func:`map`:
        ``sequential_update(prior, samples)`` or ``sequential_update(prior, designs, responses)``.

    Returns
    -------
    tuple
        The posterior after each detection point, in order.

    Examples
    --------
    >>> from friction_bayes.conjugate.gamma_exponential import GammaExponential
    >>> sequential_update(GammaExponential(1.0, 1.0), [[0.5, 0.5], [1.0]])
    (GammaExponential(alpha=3.0, kappa=2.0), GammaExponential(alpha=4.0, kappa=3.0))
    """
    history: list[Pair] = []
    posterior = prior
    for detection_point in zip(*data, strict=True):
        posterior = posterior.update(*detection_point)
        history.append(posterior)
    return tuple(history)
