"""The Cramer-Rao bound of the friction coefficient, for exact Coulomb decays in white noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.mechanics.coulomb import coulomb_decay
from friction_bayes.mechanics.testbed import PAPER_DURATION, PAPER_FRICTION, PAPER_RELEASE, PAPER_SYSTEM

__all__ = ["Decay", "bound_row", "exact_decay", "paper_decay", "rest_position"]


@dataclass(frozen=True)
class Decay:
    """A system and its noise-free record.

    Attributes
    ----------
    system : Oscillator
    friction : float
        Friction force [N].
    time, signal : ndarray, shape (n,)
        Sample times [s], and the ``order``-th derivative of the displacement at them, with its offset.
    phase : float
        Phase of the displacement at ``time[0]`` [rad].
    moving : int
        Samples before it comes to rest.
    order : int
        Derivative order of the signal.
    """

    system: Oscillator
    friction: float
    time: Array
    signal: Array
    phase: float
    moving: int
    order: int


def exact_decay(
    system: Oscillator, d: float, amplitude: float, phase: float, offset: float, time: Array, order: int
) -> Decay:
    """Exact motion with ``amplitude`` at the turning point before its start, at ``phase`` when it starts.

    ``d`` is friction over stiffness, ``offset`` is that of the sensor over the largest value of the signal.
    """
    w = system.natural_frequency
    half = np.floor(phase / np.pi)
    sign = 1.0 if half % 2 == 0 else -1.0
    swing = amplitude - (2.0 * half + 1.0) * d
    x = sign * d + swing * np.cos(phase)
    v = -w * swing * np.sin(phase)
    motion = coulomb_decay(system, d * system.stiffness, x, v, time)
    signal = (motion.displacement, motion.velocity, motion.acceleration)[order]
    moving = int(np.count_nonzero(time < motion.stop_time))
    scale = np.abs(signal).max()
    return Decay(system, d * system.stiffness, time, signal + offset * scale, phase, moving, order)


def paper_decay(order: int) -> Decay:
    """The paper's numerical example, at 1 kHz, released from rest."""
    d = PAPER_FRICTION / PAPER_SYSTEM.stiffness
    time = np.arange(round(1000.0 * PAPER_DURATION)) / 1000.0
    return exact_decay(PAPER_SYSTEM, d, PAPER_RELEASE, 0.0, 0.0, time, order)


def bound_row(decay: Decay, amplitude: float) -> Array:
    """Weights of the noise in the efficient linear estimator of the friction coefficient, shape (moving,).

    ``amplitude`` is that of the displacement at the turning point before the start. Offset, amplitude,
    friction coefficient, frequency and phase are all unknown; noise of standard deviation ``s`` leaves the
    friction coefficient a standard deviation of ``s`` times the norm of the weights, the Cramer-Rao bound.
    """
    w, t = decay.system.natural_frequency, decay.time[: decay.moving]
    u = decay.friction / decay.system.stiffness * w**decay.order
    theta = w * t + decay.phase
    half = np.floor(theta / np.pi)
    f = np.cos(theta + 0.5 * np.pi * decay.order)
    g = -np.sin(theta + 0.5 * np.pi * decay.order)
    swing = amplitude * w**decay.order - (2.0 * half + 1.0) * u
    jump = (-1.0) ** half if decay.order == 0 else 0.0
    design = np.column_stack(
        [np.ones_like(t), f, jump - (2.0 * half + 1.0) * f, swing * g * w * (t - t.mean()), swing * g]
    )
    scale = np.linalg.norm(design, axis=0)
    return np.linalg.pinv(design / scale)[2] / scale[2]


def rest_position(decay: Decay) -> float:
    """Offset of the noise-free signal: velocity and acceleration vanish at rest, displacement is known."""
    w, t = decay.system.natural_frequency, decay.time[: decay.moving]
    theta = w * t + decay.phase
    half = np.floor(theta / np.pi)
    f = np.cos(theta + 0.5 * np.pi * decay.order)
    jump = (-1.0) ** half if decay.order == 0 else np.zeros_like(t)
    design = np.column_stack([np.ones_like(t), f, jump - (2.0 * half + 1.0) * f])
    return float(np.linalg.lstsq(design, decay.signal[: decay.moving], rcond=None)[0][0])
