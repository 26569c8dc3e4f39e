"""Dense covariance of an oscillator under a random force, by quadrature; shares no code with the package."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import expm


def dense_covariance(
    phase: np.ndarray, stiffness: np.ndarray, tau: float, beside: np.ndarray | None = None
) -> np.ndarray:
    """Covariance (3 n, 3 n) of all states for unit sd, every step by quadrature of matrix exponentials.

    With what a law makes of displacement and velocity after each step, shape (n - 1, 2, 2).
    """
    nodes, weights = np.polynomial.legendre.leggauss(12)
    n = phase.size
    own = np.zeros((n, 3, 3))
    own[0, 2, 2] = 1.0
    transitions = []
    for i, h in enumerate(np.diff(phase), start=1):
        drift = np.array([[0.0, 1.0, 0.0], [-stiffness[i - 1], 0.0, 1.0], [0.0, 0.0, -1.0 / tau]])
        pieces = math.ceil(h / min(tau, 0.5))
        u = (0.5 * (nodes + 1.0) + np.arange(pieces)[:, None]).ravel() * h / pieces
        weight = np.tile(0.5 * weights, pieces) * h / pieces
        column = expm(drift * u[:, None, None])[:, :, 2]
        transitions.append(expm(drift * h))
        own[i] = transitions[-1] @ own[i - 1] @ transitions[-1].T
        own[i] += 2.0 / tau * np.einsum("k,ka,kb->ab", weight, column, column)
        if beside is not None:
            law = np.eye(3)
            law[:2, :2] = beside[i - 1]
            transitions[-1] = law @ transitions[-1]
            own[i] = law @ own[i] @ law.T
    full = np.zeros((n, 3, n, 3))
    full[0, :, 0] = own[0]
    for i in range(1, n):
        full[i, :, :i] = np.tensordot(transitions[i - 1], full[i - 1, :, :i], 1)
        full[:i, :, i] = full[i, :, :i].transpose(1, 2, 0)
        full[i, :, i] = own[i]
    return full.reshape(3 * n, 3 * n)
