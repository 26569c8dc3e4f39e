"""A signal as a linear model along its true motion, and its covariance under a fluctuating force.

Dimensionless as :mod:`experiments.blind.laws`; shares no code with the fitted model.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from experiments.blind.disturbed_motion import DisturbedMotion, acceleration_of
from experiments.blind.draws import TURN_SWING_RAD
from experiments.blind.laws import turn_waves

__all__ = [
    "FRICTION",
    "NUISANCE",
    "Array",
    "Columns",
    "Path",
    "covariance",
    "effect_columns",
    "nuisance_columns",
]

Array = NDArray[np.float64]
Columns = dict[str, list[Array]]

NUISANCE, FRICTION = 4, 3
"""How many columns are in every set, and which of them is friction."""

_STRIBECK_VELOCITIES = (0.05, 0.12, 0.3)
_PRESLIDING = (0.004, 0.012, 0.04)
_LINES, _HIGHEST_LINE = 60, 6.0  # natural frequencies


def covariance(times: Array, order: int, sd: float, correlation_time: float, noise: Array) -> Array:
    """Covariance of the signal of an oscillator under an Ornstein-Uhlenbeck force, and noise.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Evenly spaced; the oscillator begins in a known state, the force in its stationary one.
    order : int
        0 for displacement, 2 for acceleration.
    sd, correlation_time : float
        Of the force.
    noise : ndarray, shape (n,)
        Variances.
    """
    n, step = times.size, float(times[1] - times[0])
    row = np.array([1.0, 0.0, 0.0]) if order == 0 else np.array([-1.0, 0.0, 1.0])
    flow = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 1.0], [0.0, 0.0, -1.0 / correlation_time]])
    diffusion = np.zeros((3, 3))
    diffusion[2, 2] = 2.0 * sd**2 / correlation_time
    # Van Loan: one exponential gives transition and noise of a step
    block = expm(step * np.block([[-flow, diffusion], [np.zeros((3, 3)), flow.T]]))
    transition = block[3:, 3:].T
    kick = transition @ block[:3, 3:]
    ahead = np.empty((n, 3))
    ahead[0] = row
    for i in range(1, n):
        ahead[i] = ahead[i - 1] @ transition
    state = np.diag([0.0, 0.0, sd**2])
    out = np.zeros((n, n))
    for i in range(n):
        out[i, i:] = ahead[: n - i] @ (state @ row)
        state = transition @ state @ transition.T + kick
    out += np.triu(out, 1).T
    out[np.diag_indices(n)] += noise
    return out


class Path:
    """The true motion, and the response of the oscillator to forces along it."""

    def __init__(self, motion: DisturbedMotion, times: Array, order: int) -> None:
        self.motion, self.times, self.order = motion, times, order
        self.sign = np.array([contact.sign for contact in motion.contacts])[:-1]
        turn = np.array([contact.turn for contact in motion.contacts])[:-1]
        self.t = np.stack([motion.times[:-1], motion.times[1:]])
        self.x = np.stack([motion.x[:-1], motion.x[1:]])
        self.v = np.stack([motion.v[:-1], motion.v[1:]])
        self.turned = np.abs(self.x - turn)
        self.owner = np.clip(np.searchsorted(motion.times, times, side="right") - 1, 0, self.sign.size - 1)

    def law(self) -> Array:
        """Every force of the true law but the linear spring, at both ends of each stretch."""
        law, contacts = self.motion.law, self.motion.contacts
        return np.array(
            [
                [
                    acceleration_of(law, contacts[i], t, x, v, 0.0) + x if contacts[i].sign else 0.0
                    for i, (t, x, v) in enumerate(zip(ts, xs, vs, strict=True))
                ]
                for ts, xs, vs in zip(self.t.tolist(), self.x.tolist(), self.v.tolist(), strict=True)
            ]
        )

    def response(self, force: Array) -> Array:
        """Signal of the oscillator, at rest at first, under a force given at both ends of each stretch.

        Duhamel's integral by the trapezoidal rule between knots.
        """
        half = 0.5 * np.diff(self.motion.times)
        knots = self.motion.times
        parts = []
        for wave in (np.cos(self.t), np.sin(self.t)):
            whole = np.concatenate([[0.0], np.cumsum(half * (wave * force).sum(axis=0))])
            parts.append(np.interp(self.times, knots, whole))
        out: Array = np.sin(self.times) * parts[0] - np.cos(self.times) * parts[1]
        if self.order == 2:
            out = self.at_samples(force) - out
        return out

    def at_samples(self, force: Array) -> Array:
        """A force given at both ends of each stretch, at the samples."""
        begin = self.motion.times[self.owner]
        length = self.motion.times[self.owner + 1] - begin
        share = (self.times - begin) / length
        value: Array = (1.0 - share) * force[0, self.owner] + share * force[1, self.owner]
        return value


def nuisance_columns(path: Path) -> list[Array]:
    """Columns of every set: initial displacement and velocity, stiffness, friction."""
    turn = -1.0 if path.order == 2 else 1.0
    return [
        turn * np.cos(path.times),
        turn * np.sin(path.times),
        path.response(-path.x),
        path.response(-np.broadcast_to(path.sign, path.x.shape)),
    ]


def effect_columns(path: Path, swing: float | None, mode: tuple[float, float] | None = None) -> Columns:
    """Columns of every effect, several where a parameter shapes it: each is a way to have the effect.

    Parameters
    ----------
    path : Path
    swing : float or None
        Initial amplitude [rad] of an angle. None, or too small a swing, has no column of what repeats with a
        turn.
    mode : tuple of float or None
        Frequency of the second mode and its decay rate; None has no column of one.
    """
    sign = np.broadcast_to(path.sign, path.x.shape)
    law = path.motion.law
    forces = {
        "viscous_damping": [-path.v],
        "quadratic_drag": [-path.v * np.abs(path.v)],
        "asymmetric_friction": [-np.abs(sign)],
        "stribeck_friction": [
            -sign * np.exp(-((path.v / vs) ** 2)) for vs in (law.stribeck_velocity, *_STRIBECK_VELOCITIES)
        ],
        "friction_drift": [-sign * (path.t / law.duration - 0.5)],
        "cubic_stiffness": [-(path.x**3)],
        "presliding": [
            2.0 * sign * np.exp(-path.turned / s0) for s0 in (law.presliding or _PRESLIDING[0], *_PRESLIDING)
        ],
    }
    columns = {name: [path.response(f)[:, None] for f in shapes] for name, shapes in forces.items()}
    columns["position_friction"] = [
        np.column_stack([path.response(-sign * path.x), path.response(-sign * path.x**2)])
    ]
    one = np.ones(path.times.size)
    columns["sensor_offset"] = [one[:, None]]
    columns["sensor_drift"] = [np.column_stack([one, path.times / law.duration])]
    angle = np.arange(1, _LINES + 1) * (_HIGHEST_LINE / _LINES)
    columns["periodic_interference"] = [
        np.column_stack([np.sin(w * path.times), np.cos(w * path.times)]) for w in angle
    ]
    if path.order == 0:
        columns["sensor_hysteresis"] = [-path.at_samples(sign)[:, None]]
    signal = path.motion.sample(path.times)[0 if path.order == 0 else 1]
    columns["sensor_nonlinearity"] = [np.column_stack([signal**2, signal**3])]
    if mode is not None:
        envelope, angle = np.exp(-mode[1] * path.times), mode[0] * path.times
        columns["second_mode"] = [np.column_stack([envelope * np.sin(angle), envelope * np.cos(angle)])]
    if swing is not None:
        turned = swing * path.at_samples(path.x)
        waves = [wave(k * turned) for k in (1, 2) for wave in (np.sin, np.cos)]
        columns["encoder_eccentricity"] = [np.column_stack(waves)]
    if swing is not None and swing >= TURN_SWING_RAD[0]:
        forces_of_turn = turn_waves(swing * path.x)
        columns["position_force"] = [np.column_stack([path.response(-force) for force in forces_of_turn])]
    return columns
