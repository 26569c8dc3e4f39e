"""Which further record would decide between candidates that tie, computed from the candidates themselves.

Each experiment is predicted under the most probable candidate. A rival, with its posterior from the records
so far and an initial state of its own, can follow that prediction in part; what is left is linear algebra:
with the difference ``D`` of the two predictions, noise ``s`` and the rival's derivatives ``J`` and covariance
``C``, the expected log Bayes factor is ``D' (s^2 + J C J')^-1 D / 2``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from friction_bayes.core.arrays import Array
from friction_bayes.core.text import listed
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.noise import whiten
from friction_bayes.loop.parameters import FRICTION

__all__ = ["Proposal", "expected_log_bayes_factor", "next_experiment", "proposals"]

_DECISIVE = math.log(20.0)
_STEP = 1e-3
_STATE_STEP = 1e-4
"""Difference step in the initial state, in amplitudes."""
_STATE_SD = 0.1
"""Standard deviation of the initial state of the further record, in amplitudes."""
_SAME_FRICTION = 0.01
"""Relative spread of friction over the candidates below which the choice among them does not matter."""


@dataclass(frozen=True)
class Proposal:
    """A further record.

    Attributes
    ----------
    what : str
    amplitude : float
        Release, in the present record's largest displacement.
    duration : float
        Length, in the present record's.
    order : int
        What is measured.
    log_bayes_factor : float
        Expected of the most probable candidate against the rival.
    """

    what: str
    amplitude: float
    duration: float
    order: int
    log_bayes_factor: float = 0.0


def next_experiment(fits: Sequence[LoopFit], names: Sequence[str]) -> str | None:
    """Name, in a sentence, the further record that tells the first candidate best from its rivals."""
    decided = [proposals(fits[0], rival) for rival in fits[1:]]
    if not decided or not decided[0]:
        return None
    # a record decides as well as it does against the rival it is worst at
    scores = [min(options[i].log_bayes_factor for options in decided) for i in range(len(decided[0]))]
    best = int(np.argmax(scores))
    rivals = listed(names[1:], "or")
    chosen, score = decided[0][best], scores[best]
    if score < _DECISIVE:
        return (
            f"No single further record is expected to tell {names[0]} from {rivals}; "
            f"the best, {chosen.what}, is expected to shift the odds by a factor {math.exp(score):.2g}"
            f"{_agreement_on_friction(fits)}."
        )
    factor = f"{math.exp(score):.2g}" if score < 12.0 else "more than 1e5"
    return (
        f"Add {chosen.what}: it is expected to tell {names[0]} from {rivals} by a Bayes factor of {factor}"
        f"{_agreement_on_friction(fits)}."
    )


def _agreement_on_friction(fits: Sequence[LoopFit]) -> str:
    """Say so where friction hardly depends on which candidate is right."""
    frictions = [float(fit.model.value(fit.z, FRICTION)) for fit in fits]
    spread = (max(frictions) - min(frictions)) / frictions[0]
    if spread > _SAME_FRICTION:
        return ""
    return f"; the candidates agree on friction within {max(100.0 * spread, 0.01):.2g} %"


def proposals(truth: LoopFit, rival: LoopFit) -> list[Proposal]:
    """Score the experiments on a pair of candidates."""
    order = truth.model.segments[0].order
    if order == 2:
        other = Proposal("a record of the displacement", 1.0, 1.0, 0)
    else:
        other = Proposal("a record of the acceleration", 1.0, 1.0, 2)
    options = [
        Proposal("a record released from half the amplitude", 0.5, 1.0, order),
        Proposal("a record released from twice the amplitude", 2.0, 1.0, order),
        Proposal("a record twice as long", 1.0, 2.0, order),
        other,
    ]
    return [replace(option, log_bayes_factor=_score(truth, rival, option)) for option in options]


def _score(truth: LoopFit, rival: LoopFit, option: Proposal) -> float:
    """Expected log Bayes factor of a proposed record; zero where a motion does not stay finite."""
    model, other = truth.model, rival.model
    segment = model.segments[0]
    samples = round(segment.values.size * option.duration)
    time = np.asarray(segment.decay.step * np.arange(samples), dtype=np.float64)
    largest = model.scales.amplitude * option.amplitude
    fast = largest * model.system.natural_frequency
    release = (largest, 0.0)
    target = model.predict_at(truth.z, 0, time, release, option.order)
    base = other.predict_at(rival.z, 0, time, release, option.order)
    if target is None or base is None:
        return 0.0
    signal = base.signal

    def change(z: Array, state: tuple[float, float], step: float) -> Array:
        """Derivative of the rival's prediction."""
        moved = other.predict_at(z, 0, time, state, option.order)
        return np.zeros(time.size) if moved is None else (moved.signal - signal) / step

    law = [j for j, c in enumerate(other.coordinates) if not c.is_state]
    posterior = rival.covariance
    columns = []
    for j in law:
        step = min(_STEP, 0.1 * math.sqrt(posterior[j, j]))
        moved = rival.z.copy()
        moved[j] += step
        columns.append(change(moved, release, step))
    columns.append(change(rival.z, (largest + _STATE_STEP * largest, 0.0), _STATE_STEP))
    columns.append(change(rival.z, (largest, _STATE_STEP * fast), _STATE_STEP))
    covariance = block_diag(posterior[np.ix_(law, law)], _STATE_SD**2 * np.eye(2))
    # the other sensor is taken to have the same noise relative to the signal
    sd = truth.noises[0].sd * model.system.natural_frequency ** (option.order - segment.order)
    ar = truth.noise_models[0].ar
    return expected_log_bayes_factor(
        whiten(target.signal - signal, ar) / sd, whiten(np.column_stack(columns), ar) / sd, covariance
    )


def expected_log_bayes_factor(difference: Array, jacobian: Array, covariance: Array) -> float:
    r"""Expected log Bayes factor of two linear models of a record, white noise of unit variance.

    .. math:: \tfrac12 D^T (I + J C J^T)^{-1} D,

    by Woodbury's identity. It is the expectation under the first model where both are uncertain by the same
    :math:`J C J^T`, as two models of one past record are.

    Parameters
    ----------
    difference : ndarray, shape (n,)
        Prediction of the first model minus that of the second, :math:`D`.
    jacobian : ndarray, shape (n, q)
        Derivatives of the second in its parameters, :math:`J`.
    covariance : ndarray, shape (q, q)
        Of these parameters before the record, :math:`C`.
    """
    shared = jacobian.T @ difference
    inner = np.eye(len(covariance)) + jacobian.T @ jacobian @ covariance
    absorbed = float(shared @ covariance @ np.linalg.solve(inner, shared))
    return max(0.5 * (float(difference @ difference) - absorbed), 0.0)
