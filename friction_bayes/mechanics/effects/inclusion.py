r"""How probable it is, before a record, which effects act.

Every effect of the catalogue acts with the same probability :math:`p`, which is not known:
:math:`p \sim \mathrm{Beta}(1, N / m)` for a catalogue of :math:`N` effects of which about :math:`m` are
expected to act. That :math:`k` given effects of :math:`n` act and the others do not has the probability

.. math:: \frac{B(1 + k, N / m + n - k)}{B(1, N / m)},

whichever :math:`n` of the catalogue are considered. The number that act is nearly geometric (none: one half,
one: a quarter, ...) however long the catalogue is: an effect added to it takes its share from the sets
of as many effects, and not from the plain record (Scott and Berger, Ann. Stat. 38, 2010).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import betaln

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.mechanics.effects.registry import EFFECTS

__all__ = ["EXPECTED", "inclusion", "log_probability", "prior_log_odds"]

EXPECTED = 1.0
"""Effects that are expected to act on a machine. Then none acts with probability one half."""


def log_probability(acting: Indices | int, considered: int, expected: float = EXPECTED) -> Array:
    """Logarithm of the probability that given effects act, and the others of those considered do not.

    Parameters
    ----------
    acting : int or ndarray of int
        Number of those that act.
    considered : int
    expected : float
        Number of effects that are expected of the whole catalogue.
    """
    others = len(EFFECTS) / expected
    return np.asarray(betaln(1.0 + acting, others + considered - acting) - betaln(1.0, others))


def inclusion() -> float:
    """Probability that a given effect acts, whatever the others do."""
    return EXPECTED / (EXPECTED + len(EFFECTS))


def prior_log_odds() -> float:
    """Of a given effect, whatever the others do."""
    return math.log(EXPECTED / len(EFFECTS))
