"""How strongly each effect acts: the stated ranges, drawn blindly, never tuned to a record.

All strengths are dimensionless (see :mod:`experiments.blind.laws`); "loss" is amplitude lost a half cycle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from experiments.blind.laws import HARMONICS, turn_waves

__all__ = [
    "CATALOGUE",
    "CONTACT_AND_SENSOR",
    "EXCLUSIVE",
    "FORCE_EFFECTS",
    "OUTSIDE",
    "TURN_SWING_RAD",
    "Setting",
    "draw_contact_or_sensor",
    "draw_effect",
    "draw_force",
    "draw_outside",
    "pairs",
]

FORCE_EFFECTS = (
    "viscous_damping",
    "quadratic_drag",
    "asymmetric_friction",
    "stribeck_friction",
    "friction_drift",
    "cubic_stiffness",
)
SENSOR_EFFECTS = ("sensor_offset", "sensor_drift", "sensor_clipping", "periodic_interference", "outliers")
CATALOGUE = FORCE_EFFECTS + SENSOR_EFFECTS
CONTACT_AND_SENSOR = (
    "presliding",
    "backlash",
    "held_counts",
    "timing_jitter",
    "encoder_eccentricity",
    "disturbed_release",
    "position_force",
    "sensor_nonlinearity",
    "position_friction",
    "second_mode",
)
"""Kinds drawn for the records with a fluctuating force alone, not for the sealed test without one."""
TURN_SWING_RAD = (0.5 * math.pi, 6.0)
"""Swings in which a force that repeats with every turn differs from a spring that hardens or softens."""
OUTSIDE = ("one_sided_spring", "rough_patch", "stick_slip_base")

EXCLUSIVE = (
    frozenset({"sensor_offset", "sensor_drift"}),
    frozenset({"asymmetric_friction", "sensor_offset"}),
    frozenset({"asymmetric_friction", "sensor_drift"}),
)
"""Pairs that are never drawn: the first is one effect twice; in displacement the others are a sensor
offset or a sensor drift alone, exactly."""


@dataclass(frozen=True)
class Setting:
    """What the strengths are measured against, all dimensionless.

    Attributes
    ----------
    friction : float
        ``d``.
    final_amplitude : float
        Aimed-at amplitude at the end of the record.
    duration : float
        Aimed-at length of the record.
    samples_per_period : float
        Sampling rate over natural frequency.
    """

    friction: float
    final_amplitude: float
    duration: float
    samples_per_period: float


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def either_sign(rng: np.random.Generator) -> float:
    """Draw -1 or 1."""
    return float(rng.choice((-1.0, 1.0)))


def draw_effect(name: str, rng: np.random.Generator, at: Setting, loss_share: float) -> dict[str, float]:
    """Draw the parameters of one catalogue effect.

    Ranges
    ------
    viscous_damping, quadratic_drag
        Loss of ``loss_share`` (uniform 0.02 .. 0.5, halved in pairs) of the Coulomb loss.
    asymmetric_friction
        ``|e|`` uniform 0.05 .. 0.6.
    stribeck_friction
        Excess uniform 0.3 .. 1.5, velocity log-uniform 0.05 .. 0.5 of the highest.
    friction_drift
        ``|relative change|`` uniform 0.1 .. 1.2.
    cubic_stiffness
        ``|k3 A**2 / k|`` log-uniform 0.003 .. 0.2.
    sensor_offset, sensor_drift
        ``|offset|`` log-uniform 0.01 .. 0.2 and the drift over the record 0.03 .. 0.3 of the motion's RMS.
    sensor_clipping
        Level uniform 0.5 .. 0.9 of the signal's largest value.
    periodic_interference
        Amplitude log-uniform 0.02 .. 0.3 of the motion's RMS, frequency log-uniform 0.2 .. 20 natural
        frequencies and below 0.4 of the sampling rate.
    outliers
        Fraction uniform 0.005 .. 0.05, scale log-uniform 5 .. 30.
    """
    q = at.final_amplitude
    if name == "viscous_damping":
        return {"damping_ratio": 2.0 * at.friction * loss_share / (math.pi * (1.0 + q) / 2.0)}
    if name == "quadratic_drag":
        return {"drag": 2.0 * at.friction * loss_share / (4.0 / 3.0 * (1.0 + q + q * q) / 3.0)}
    if name == "asymmetric_friction":
        return {"asymmetry": either_sign(rng) * rng.uniform(0.05, 0.6)}
    if name == "stribeck_friction":
        return {"static_excess": rng.uniform(0.3, 1.5), "stribeck_velocity": log_uniform(rng, 0.05, 0.5)}
    if name == "friction_drift":
        return {"relative_change": either_sign(rng) * rng.uniform(0.1, 1.2)}
    if name == "cubic_stiffness":
        return {"cubic": either_sign(rng) * log_uniform(rng, 0.003, 0.2)}
    if name == "sensor_offset":
        return {"offset": either_sign(rng) * log_uniform(rng, 0.01, 0.2)}
    if name == "sensor_drift":
        offset = either_sign(rng) * log_uniform(rng, 0.01, 0.2)
        return {"offset": offset, "drift": either_sign(rng) * log_uniform(rng, 0.03, 0.3)}
    if name == "sensor_clipping":
        return {"clipping": rng.uniform(0.5, 0.9)}
    if name == "periodic_interference":
        return {
            "interference_amplitude": log_uniform(rng, 0.02, 0.3),
            "interference_frequency": log_uniform(rng, 0.2, min(20.0, 0.4 * at.samples_per_period)),
            "interference_phase": rng.uniform(0.0, 2.0 * math.pi),
        }
    if name == "outliers":
        return {"outlier_fraction": rng.uniform(0.005, 0.05), "outlier_scale": log_uniform(rng, 5.0, 30.0)}
    raise ValueError(f"unknown effect {name!r}")


def draw_outside(
    name: str, rng: np.random.Generator, at: Setting, strength: float
) -> dict[str, float | tuple[float, ...]]:
    """Draw the parameters of an effect outside the catalogue, its size multiplied by ``strength``.

    Ranges before the multiplication
    --------------------------------
    one_sided_spring
        Gap uniform 0.3 .. 0.8 of the initial amplitude, stiffness log-uniform 0.02 .. 0.5 of the spring's.
    rough_patch
        Friction higher by 0.5 .. 3 times, over a half width of 0.05 .. 0.2 centred 0.2 .. 0.6 off the middle.
    stick_slip_base
        The support creeps and slips back by 1 .. 5 friction displacements ``d`` every 2 .. 8 periods.
    """
    if name == "one_sided_spring":
        return {"stop_gap": rng.uniform(0.3, 0.8), "stop_stiffness": strength * log_uniform(rng, 0.02, 0.5)}
    if name == "rough_patch":
        return {
            "patch_centre": either_sign(rng) * rng.uniform(0.2, 0.6),
            "patch_width": rng.uniform(0.05, 0.2),
            "patch_boost": strength * rng.uniform(0.5, 3.0),
        }
    if name == "stick_slip_base":
        slip = strength * at.friction * rng.uniform(1.0, 5.0)
        period = 2.0 * math.pi * rng.uniform(2.0, 8.0)
        waits = period * rng.uniform(0.7, 1.3, size=math.ceil(3.0 * at.duration / period))
        return {
            "base_slip": slip,
            "base_creep": slip / period,
            "base_slips": tuple(np.cumsum(waits).tolist()),
        }
    raise ValueError(f"unknown effect {name!r}")


def draw_contact_or_sensor(
    name: str, rng: np.random.Generator, at: Setting
) -> dict[str, float | tuple[float, ...]]:
    """Draw the parameters of one effect of the contact, the sensor's mechanism or its clock.

    Ranges
    ------
    presliding
        Displacement log-uniform 0.003 .. 0.05 of the initial amplitude.
    backlash, held_counts
        Half width (half the step of the encoder) log-uniform 0.3 .. 3 friction displacements ``d``.
    timing_jitter
        Of the sampling times, such that root mean square velocity times jitter is 0.5 .. 3 noise sd
        (log-uniform).
    encoder_eccentricity
        Once a turn log-uniform 0.01 .. 0.1 of the motion's RMS, twice a turn 0.3 .. 1 of that.
    disturbed_release
        A hand's force of 2 .. 20 times friction (log-uniform) that swells and fades over the first 0.5 .. 3
        half cycles.
    position_force
        Swing log-uniform 0.5 pi .. 6 rad; root mean square of the force along a decay by friction alone
        log-uniform 0.1 .. 1 of friction; its sines and cosines normal draws times ``n**p``, ``p`` uniform
        -1 .. 1.
    sensor_nonlinearity
        A scale bent by 0.003 .. 0.05 (log-uniform) of the signal at the initial amplitude, its square and its
        cube sharing that uniformly, each either way.
    position_friction
        Slope and curvature take 0.3 .. 0.9 of friction (log-uniform) at the initial amplitude between them,
        shared out uniformly, each either way.
    second_mode
        Amplitude log-uniform 0.03 .. 0.15 of the motion's RMS, frequency 1.7 .. 6 natural frequencies,
        decaying by e within 0.05 .. 0.3 of the record.
    """
    if name == "presliding":
        return {"presliding": log_uniform(rng, 0.003, 0.05)}
    if name in ("backlash", "held_counts"):
        return {name: at.friction * log_uniform(rng, 0.3, 3.0)}
    if name == "timing_jitter":
        return {"jitter_over_noise": log_uniform(rng, 0.5, 3.0)}
    if name == "encoder_eccentricity":
        once = log_uniform(rng, 0.01, 0.1)
        return {
            "once_a_turn": once,
            "once_phase": rng.uniform(0.0, 2.0 * math.pi),
            "twice_a_turn": once * rng.uniform(0.3, 1.0),
            "twice_phase": rng.uniform(0.0, 2.0 * math.pi),
        }
    if name == "disturbed_release":
        return {
            "hand_force": either_sign(rng) * at.friction * log_uniform(rng, 2.0, 20.0),
            "hand_until": math.pi * rng.uniform(0.5, 3.0),
            "hand_frequency": rng.uniform(0.3, 3.0),
        }
    if name == "position_force":
        swing, over_friction = log_uniform(rng, *TURN_SWING_RAD), log_uniform(rng, 0.1, 1.0)
        rising = np.arange(1.0, HARMONICS + 1.0) ** rng.uniform(-1.0, 1.0)
        parts = rng.normal(size=(2, HARMONICS)) * rising
        # fifty samples a period of the highest harmonic where the widest swing is fastest
        times = np.arange(0.0, at.duration, 0.005)
        decay = (1.0 - (1.0 - at.final_amplitude) * times / at.duration) * np.cos(times)
        force = parts.ravel() @ turn_waves(swing * decay)
        parts *= over_friction * at.friction / np.sqrt(np.mean(force**2))
        return {
            "swing": swing,
            "position_force_over_friction": over_friction,
            "turn_sines": tuple(parts[0].tolist()),
            "turn_cosines": tuple(parts[1].tolist()),
        }
    if name == "sensor_nonlinearity":
        size, share = log_uniform(rng, 0.003, 0.05), rng.uniform(0.0, 1.0)
        return {
            "scale_square": either_sign(rng) * size * share,
            "scale_cube": either_sign(rng) * size * (1.0 - share),
        }
    if name == "position_friction":
        size, share = log_uniform(rng, 0.3, 0.9), rng.uniform(0.0, 1.0)
        return {
            "friction_tilt": either_sign(rng) * size * share,
            "friction_bend": either_sign(rng) * size * (1.0 - share),
        }
    if name == "second_mode":
        return {
            "mode_amplitude": log_uniform(rng, 0.03, 0.15),
            "mode_frequency": rng.uniform(1.7, 6.0),
            "mode_decay": 1.0 / (rng.uniform(0.05, 0.3) * at.duration),
            "mode_phase": rng.uniform(0.0, 2.0 * math.pi),
        }
    raise ValueError(f"unknown effect {name!r}")


def draw_force(rng: np.random.Generator) -> dict[str, float]:
    """Draw a fluctuating force: sd 0.05 .. 0.6 of friction, correlation time 0.01 .. 1 natural periods.

    Both log-uniform.
    """
    return {
        "force_over_friction": log_uniform(rng, 0.05, 0.6),
        "force_correlation_time": 2.0 * math.pi * log_uniform(rng, 0.01, 1.0),
    }


def pairs(kind: str) -> list[tuple[str, str]]:
    """Pairs of catalogue effects of one kind: ``two_forces``, ``force_and_sensor`` or ``two_sensors``."""
    wanted = {"two_forces": 2, "force_and_sensor": 1, "two_sensors": 0}[kind]
    return [
        pair
        for pair in combinations(CATALOGUE, 2)
        if frozenset(pair) not in EXCLUSIVE and sum(name in FORCE_EFFECTS for name in pair) == wanted
    ]
