"""Draws from the posterior over all candidates."""

from __future__ import annotations

from dataclasses import dataclass

from friction_bayes.core.arrays import Array, Integers

__all__ = ["CandidateDraws"]


@dataclass(frozen=True, kw_only=True, eq=False)
class CandidateDraws:
    """Draws from the posterior, each candidate in proportion to its probability.

    Attributes
    ----------
    candidate : ndarray of int, shape (k,)
        Which of the candidates each draw has.
    friction : ndarray, shape (k,)
        Friction force of the declared system [N or N m].
    frequency : ndarray, shape (k,)
        Natural frequency [rad/s].
    random_force, correlation_time : ndarray, shape (k,)
        Sd of the random force [N or N m], zero without one, and its correlation time [s].
    coefficients : ndarray of int, shape (k,)
        How many coefficients of effects each draw has whose prior is normal.
    squares : ndarray, shape (k,)
        Sum of their squares, in variances of the prior.
    """

    candidate: Integers
    friction: Array
    frequency: Array
    random_force: Array
    correlation_time: Array
    coefficients: Integers
    squares: Array
