"""Dense covariance of an oscillator under a random force, by quadrature; shares no code with the package."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from scipy.linalg import expm

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


@cache
def _step(h: float, stiffness: float, tau: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition of a step and the covariance that the force adds over it."""
    drift = np.array([[0.0, 1.0, 0.0], [-stiffness, 0.0, 1.0], [0.0, 0.0, -1.0 / tau]])
    pieces = math.ceil(h / min(tau, 0.5))
    u = (0.5 * (NODES + 1.0) + np.arange(pieces)[:, None]).ravel() * h / pieces
    weight = np.tile(0.5 * WEIGHTS, pieces) * h / pieces
    column = expm(drift * u[:, None, None])[:, :, 2]
    return expm(drift * h), 2.0 / tau * np.einsum("k,ka,kb->ab", weight, column, column)


def dense_covariance(
    phase: np.ndarray, stiffness: np.ndarray, tau: float, law_steps: np.ndarray | None = None
) -> np.ndarray:
    """Covariance (3 n, 3 n) of all states for unit sd, every step by quadrature of matrix exponentials.

    Displacement and velocity are multiplied by ``law_steps``, shape (n - 1, 2, 2), after each step.
    """
    n = phase.size
    own = np.zeros((n, 3, 3))
    own[0, 2, 2] = 1.0
    transitions = []
    # steps that are equal to rounding are one
    for i, h in enumerate(np.diff(phase).round(13).tolist(), start=1):
        transition, added = _step(h, float(stiffness[i - 1]), tau)
        transitions.append(transition)
        own[i] = transition @ own[i - 1] @ transition.T + added
        if law_steps is not None:
            law = np.eye(3)
            law[:2, :2] = law_steps[i - 1]
            transitions[-1] = law @ transitions[-1]
            own[i] = law @ own[i] @ law.T
    full = np.zeros((n, 3, n, 3))
    full[0, :, 0] = own[0]
    for i in range(1, n):
        full[i, :, :i] = np.tensordot(transitions[i - 1], full[i - 1, :, :i], 1)
        full[:i, :, i] = full[i, :, :i].transpose(1, 2, 0)
        full[i, :, i] = own[i]
    return full.reshape(3 * n, 3 * n)
