"""Which further record would decide between candidates that tie, computed from the candidates themselves.

Each experiment is predicted under the most probable candidate. How far a rival, with what it has learnt
from the records so far and with an initial state of its own, can follow that prediction is linear algebra:
with the difference ``D`` of the two predictions, noise ``s`` and the rival's derivatives ``J`` and covariance
``C``, the expected log Bayes factor is ``D' (s^2 + J C J')^-1 D / 2``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.text import listed
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.noise import whiten

__all__ = ["Proposal", "next_experiment", "proposals"]

_DECISIVE = math.log(20.0)
_STEP = 1e-3
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
    """Say so where friction hardly hangs on which candidate is right."""
    frictions = [float(fit.model.physical(fit.z)[0]) for fit in fits]
    spread = (max(frictions) - min(frictions)) / frictions[0]
    if spread > _SAME_FRICTION:
        return ""
    return f"; for friction it does not matter, on which they agree within {max(100.0 * spread, 0.01):.2g} %"


def proposals(truth: LoopFit, rival: LoopFit) -> list[Proposal]:
    """Score the experiments on a pair of candidates."""
    segment = truth.model.segments[0]
    order = segment.order
    options = [
        Proposal("a record released from half the amplitude", 0.5, 1.0, order),
        Proposal("a record released from twice the amplitude", 2.0, 1.0, order),
        Proposal("a record twice as long", 1.0, 2.0, order),
    ]
    if order == 2:
        options.append(Proposal("a record of the displacement", 1.0, 1.0, 0))
    else:
        options.append(Proposal("a record of the acceleration", 1.0, 1.0, 2))
    return [
        Proposal(o.what, o.amplitude, o.duration, o.order, _expected_log_bayes_factor(truth, rival, o))
        for o in options
    ]


def _expected_log_bayes_factor(truth: LoopFit, rival: LoopFit, option: Proposal) -> float:
    model = truth.model
    segment = model.segments[0]
    time = np.asarray(
        segment.decay.step * np.arange(round(segment.values.size * option.duration)), dtype=np.float64
    )
    largest = model.scales.amplitude * option.amplitude
    state = (largest, 0.0)
    target = model.predict_at(truth.z, 0, time, state, option.order)
    base = rival.model.predict_at(rival.z, 0, time, state, option.order)
    if target is None or base is None:
        return 0.0
    # the other sensor is taken to have the same noise relative to the signal
    unit = model.system.natural_frequency ** (option.order - segment.order)
    sd = truth.noises[0].sd * unit
    columns = [
        _change(rival, time, state, option.order, base.signal, j)
        for j in range(rival.z.size)
        if not _state(rival, j)
    ]
    kept = [j for j in range(rival.z.size) if not _state(rival, j)]
    free = [
        _moved(rival, time, (state[0] + 1e-4 * largest, state[1]), option.order, base.signal, 1e-4),
        _moved(
            rival,
            time,
            (state[0], 1e-4 * largest * model.system.natural_frequency),
            option.order,
            base.signal,
            1e-4,
        ),
    ]
    ar = truth.noise_models[0].ar
    jacobian = whiten(np.column_stack(columns + free), ar) / sd
    covariance = np.zeros((len(kept) + 2, len(kept) + 2))
    covariance[: len(kept), : len(kept)] = rival.covariance[np.ix_(kept, kept)]
    covariance[len(kept) :, len(kept) :] = 0.1**2 * np.eye(2)
    difference = whiten(target.signal - base.signal, ar) / sd
    shared = jacobian.T @ difference
    inner = np.linalg.inv(covariance + 1e-15 * np.eye(len(covariance))) + jacobian.T @ jacobian
    return max(0.5 * float(difference @ difference - shared @ np.linalg.solve(inner, shared)), 0.0)


def _state(fit: LoopFit, j: int) -> bool:
    c = fit.model.coordinates[j]
    return c.effect == "" and c.record >= 0


def _change(fit: LoopFit, time: Array, state: tuple[float, float], order: int, base: Array, j: int) -> Array:
    moved = fit.z.copy()
    step = min(_STEP, 0.1 * math.sqrt(fit.covariance[j, j]))
    moved[j] += step
    other = fit.model.predict_at(moved, 0, time, state, order)
    return np.zeros(base.size) if other is None else (other.signal - base) / step


def _moved(
    fit: LoopFit, time: Array, state: tuple[float, float], order: int, base: Array, step: float
) -> Array:
    other = fit.model.predict_at(fit.z, 0, time, state, order)
    return np.zeros(base.size) if other is None else (other.signal - base) / step
