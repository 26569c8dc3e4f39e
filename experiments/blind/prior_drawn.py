"""One record of a law, its sensor and its noise, all given: for records drawn from a prior.

Dimensionless as :mod:`experiments.blind.laws`; a velocity or an acceleration is over that of the amplitude.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from experiments.blind.disturbed_motion import DisturbedMotion, integrate_disturbed
from experiments.blind.laws import Law
from experiments.blind.ornstein_uhlenbeck import ornstein_uhlenbeck
from experiments.blind.sensor_faults import with_sensor

__all__ = [
    "AddedLaw",
    "Sensor",
    "measure",
    "move",
    "pushed_share",
    "reading",
    "release",
    "shows_a_decay",
    "turning_points",
]

Signal = NDArray[np.float64]

_STEP = 0.02
_STEP_OF_CONTACT = 0.005
_STEPS_A_CORRELATION_TIME = 20.0
_LEAST_TURNS = 5
_MOST_LEFT = 0.9
"""Of the first turning point's amplitude, at the last one."""
_MOST_GROWN = 1.02
_LEAST_MOVING = 0.85
"""Share of the record in which the mass moves."""


class AddedLaw(Law):
    """The same, but friction's changes add up instead of multiplying each other."""

    def level(self, t: float, x: float, v: float, sign: float) -> float:
        """Friction level of a motion in direction ``sign``."""
        level = 1.0 + self.asymmetry * sign + x * (self.friction_tilt + self.friction_bend * x)
        if self.static_excess:
            level += self.static_excess * math.exp(-((v / self.stribeck_velocity) ** 2))
        if self.relative_change:
            level += self.relative_change * self.drifted(t / self.duration)
        return self.friction * level


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Errors of the sensor; zero and empty mean absent.

    Attributes
    ----------
    order : int
        Derivative that is measured.
    faults : dict
        Strengths of :func:`experiments.blind.sensor_faults.with_sensor`, over the amplitude.
    lag : float
        A reading behind the motion, by this much on the way in either direction.
    turn_sines, turn_cosines : tuple of float
        Error that repeats with every turn, over the amplitude.
    swing : float
        Initial amplitude [rad], for these.
    clipping : float
        Level beyond which it shows nothing, over the amplitude.
    noise_share : float
        Noise in proportion to the signal.
    jitter : float
        Of the sampling times.
    outlier_fraction, outlier_sd : float
        Share of the samples whose noise has another standard deviation, over the amplitude.
    """

    order: int
    faults: Mapping[str, Any] = field(default_factory=dict)
    lag: float = 0.0
    turn_sines: tuple[float, ...] = ()
    turn_cosines: tuple[float, ...] = ()
    swing: float = 0.0
    clipping: float = math.inf
    noise_share: float = 0.0
    jitter: float = 0.0
    outlier_fraction: float = 0.0
    outlier_sd: float = 0.0


def release(phase: float) -> tuple[float, float]:
    """Displacement and velocity at a phase of the unit amplitude; at zero the mass is at rest."""
    return math.cos(phase), -math.sin(phase) if phase else 0.0


def move(
    law: Law,
    start: tuple[float, float],
    force: tuple[float, float] | None,
    rng: np.random.Generator,
) -> DisturbedMotion:
    """Follow a law to its duration.

    Parameters
    ----------
    law : Law
    start : tuple of float
        Displacement and velocity.
    force : tuple of float or None
        Standard deviation and correlation time of a random force.
    rng : Generator
        Of its path.
    """
    step = _STEP_OF_CONTACT if law.presliding else _STEP
    if force is not None:
        step = min(step, force[1] / _STEPS_A_CORRELATION_TIME)
    n = math.ceil(law.duration / step) + 1
    path = np.zeros(n) if force is None else ornstein_uhlenbeck(rng, *force, step, n)
    return integrate_disturbed(law, *start, step, path)


def turning_points(motion: DisturbedMotion) -> Signal:
    """Where the motion turns."""
    return motion.sample(motion.turning_times)[0]


def shows_a_decay(motion: DisturbedMotion) -> bool:
    """Whether a record of the motion is one of a free decay: nothing but what the record itself shows."""
    moved = math.inf if motion.rest_time is None else motion.rest_time
    if motion.turning_times.size < _LEAST_TURNS or moved < _LEAST_MOVING * motion.law.duration:
        return False
    swings = 0.5 * np.abs(np.diff(turning_points(motion)))
    return bool(swings[-1] < _MOST_LEFT * swings[0] and swings.max() < _MOST_GROWN * swings[0])


def pushed_share(motion: DisturbedMotion) -> float:
    """Share of the work of friction, in size, that drives the motion instead of resisting it."""
    law = motion.law
    knots = zip(motion.times.tolist(), motion.x.tolist(), motion.v.tolist(), motion.contacts, strict=True)
    work = np.array([law.level(t, x, v, contact.sign) * abs(v) for t, x, v, contact in knots])
    size = float(np.abs(work).sum())
    return float(np.maximum(-work, 0.0).sum()) / size if size else 0.0


def reading(motion: DisturbedMotion, order: int, times: Signal) -> Signal:
    """Displacement, velocity or acceleration at ``times``, as ``order`` is 0, 1 or 2."""
    if order == 1:
        velocity: Signal = CubicHermiteSpline(motion.times, motion.x, motion.v)(times, 1)
        return velocity
    return motion.sample(times)[order // 2]


def measure(
    motion: DisturbedMotion, sensor: Sensor, times: Signal, noise_sd: float, rng: np.random.Generator
) -> tuple[Signal, int]:
    """What a sensor shows of a motion, over the amplitude, and how many samples it clips.

    Parameters
    ----------
    motion : DisturbedMotion
    sensor : Sensor
    times : ndarray, shape (n,)
        Of the samples.
    noise_sd : float
        Over the amplitude.
    rng : Generator
        Of the noise.
    """
    taken = times
    if sensor.jitter:
        taken = np.clip(times + rng.normal(0.0, sensor.jitter, times.size), 0.0, float(motion.times[-1]))
    clean = reading(motion, sensor.order, taken)
    shown = with_sensor(clean, times, 1.0, 1.0, sensor.faults)
    if sensor.lag:
        shown = shown - sensor.lag * np.sign(reading(motion, 1, times))
    for n, (sine, cosine) in enumerate(zip(sensor.turn_sines, sensor.turn_cosines, strict=True), 1):
        angle = n * sensor.swing * clean
        shown = shown + sine * np.sin(angle) + cosine * np.cos(angle)
    noise = rng.normal(0.0, noise_sd, times.size)
    if sensor.outlier_fraction:
        hit = rng.random(times.size) < sensor.outlier_fraction
        noise = np.where(hit, rng.normal(0.0, sensor.outlier_sd, times.size), noise)
    if sensor.noise_share:
        noise = noise + clean * rng.normal(0.0, sensor.noise_share, times.size)
    measured = shown + noise
    clipped = int(np.sum(np.abs(measured) > sensor.clipping))
    return np.clip(measured, -sensor.clipping, sensor.clipping), clipped
