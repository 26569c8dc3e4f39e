"""Records whose friction force fluctuates: a sealed truth with an Ornstein-Uhlenbeck force added to it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.blind.disturbed_motion import DisturbedMotion, integrate_disturbed
from experiments.blind.draws import CONTACT_AND_SENSOR, draw_force
from experiments.blind.generator import KINDS, draw
from experiments.blind.laws import Law
from experiments.blind.ornstein_uhlenbeck import ornstein_uhlenbeck
from experiments.blind.sealed import SealedRecord

__all__ = ["FLUCTUATING_KINDS", "RANDOM_FORCE", "draw_fluctuating"]

FLUCTUATING_KINDS = (*KINDS, *CONTACT_AND_SENSOR)
RANDOM_FORCE = "random_force"

_LONGEST_STEP = 0.01
_STEPS_A_CORRELATION_TIME = 20.0


def _hand(times: NDArray[np.float64], drawn: dict[str, Any]) -> NDArray[np.float64]:
    """Force of a hand that has not let go yet: it swells and fades."""
    if "hand_force" not in drawn:
        return np.zeros(times.size)
    until = drawn["hand_until"]
    window = np.where(times < until, np.sin(math.pi * times / until) ** 2, 0.0)
    return drawn["hand_force"] * window * np.cos(drawn["hand_frequency"] * times)


def draw_fluctuating(
    kind: str, seed: np.random.SeedSequence | int, *, with_force: bool = True
) -> SealedRecord:
    """Draw one record of a kind, with a fluctuating force or without.

    Parameters
    ----------
    kind : str
        One of :data:`FLUCTUATING_KINDS`.
    seed : SeedSequence or int
        Decides everything.
    with_force : bool
        Whether the force fluctuates.

    Returns
    -------
    SealedRecord
        ``truth.effects`` and ``truth.visible`` contain ``random_force`` where there is one; its
        ``truth.parameters`` are ``force_sd`` [N or N m], ``correlation_time_s``, and, as drawn,
        ``force_over_friction`` and ``force_correlation_time``.
    """
    sequence = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    # spawned without counting: the same sequence draws the same record again
    seed_of_record, seed_of_force = (
        np.random.SeedSequence(sequence.entropy, spawn_key=(*sequence.spawn_key, child)) for child in (0, 1)
    )
    rng = np.random.default_rng(seed_of_force)
    force = draw_force(rng)
    share, correlation_time = force["force_over_friction"], force["force_correlation_time"]
    step = min(_LONGEST_STEP, correlation_time / _STEPS_A_CORRELATION_TIME) if with_force else _LONGEST_STEP

    def disturbed(law: Law, x: float, v: float, end: float, drawn: dict[str, Any]) -> DisturbedMotion:
        n = math.ceil(end / step) + 1
        path = _hand(step * np.arange(n), drawn)
        if with_force:
            path += ornstein_uhlenbeck(rng, share * law.friction, correlation_time, step, n)
        return integrate_disturbed(law, x, v, step, path)

    sealed = draw(kind, seed_of_record, integrator=disturbed)
    # a release that is still disturbed is no part of the law: the record is to be cut there
    effects = tuple(name for name in sealed.truth.effects if name != "disturbed_release")
    visible = tuple(name for name in sealed.truth.visible if name != "disturbed_release")
    parameters = sealed.truth.parameters
    if with_force:
        effects, visible = (*effects, RANDOM_FORCE), (*visible, RANDOM_FORCE)
        parameters = parameters | {
            **force,
            "force_sd": share * sealed.truth.friction,
            "correlation_time_s": correlation_time / sealed.natural_frequency,
        }
    return replace(
        sealed, truth=replace(sealed.truth, effects=effects, visible=visible, parameters=parameters)
    )
