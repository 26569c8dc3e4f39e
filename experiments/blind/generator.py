"""Draw a record with a sealed truth, all from one seed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.blind.disturbed_motion import DisturbedMotion
from experiments.blind.draws import (
    CATALOGUE,
    CONTACT_AND_SENSOR,
    OUTSIDE,
    Setting,
    draw_contact_or_sensor,
    draw_effect,
    draw_outside,
    log_uniform,
    pairs,
)
from experiments.blind.laws import Law, Motion, integrate
from experiments.blind.sealed import SealedRecord, Truth
from experiments.blind.sensor_faults import with_sensor
from friction_bayes import make_record

__all__ = ["KINDS", "PAIR_KINDS", "Integrator", "draw", "trace_of"]

PAIR_KINDS = ("two_forces", "force_and_sensor", "two_sensors")
KINDS = ("plain_coulomb", *CATALOGUE, *PAIR_KINDS, *OUTSIDE)

HALF_CYCLES = (36, 90)
SIGNAL_TO_NOISE_DB = (22.0, 34.0)
SAMPLES_PER_PERIOD = (60.0, 250.0)
NATURAL_FREQUENCY_HZ = (0.2, 50.0)
AMPLITUDE_M = (1e-4, 0.1)
AMPLITUDE_RAD = (0.02, 0.6)
WIDE_SWING_RAD = (0.5, 6.0)
"""Where the sensor's error depends on the angle: within a small swing it is an offset and a scale."""
MASS_KG = (0.05, 500.0)
INERTIA_KG_M2 = (1e-4, 10.0)
FRICTION_COEFFICIENT = (1e-5, 0.3)
"""Of the weight, for linear systems: what no bearing has is not drawn."""

_GRAVITY = 9.80665
_QUANTITIES = ("displacement", "acceleration", "angle")
_MEASURED_BY = {
    "backlash": ("displacement", "angle"),
    "held_counts": ("displacement", "angle"),
    "encoder_eccentricity": ("angle",),
    "position_force": ("angle",),
}
"""Where not any quantity will do."""
_NAMES = {"backlash": "sensor_hysteresis", "held_counts": "sensor_hysteresis"}
"""What the loop calls an effect, where that is another name."""
Integrator = Callable[[Law, float, float, float, dict[str, Any]], Motion | DisturbedMotion]
"""Law, displacement, velocity, end and drawn strengths: the motion."""

_LAW_FIELDS = frozenset(Law.__dataclass_fields__)


def trace_of(effects: tuple[str, ...], quantity: str) -> tuple[str, ...]:
    """Drop what cannot leave a trace in ``quantity``.

    Asymmetric friction shifts the centre by the constant ``e d`` where restoring force is linear and
    friction constant; an acceleration record does not know where the centre is.
    """
    shifts_alone = not {"stribeck_friction", "friction_drift", "cubic_stiffness"} & set(effects)
    if quantity == "acceleration" and shifts_alone:
        return tuple(name for name in effects if name != "asymmetric_friction")
    return effects


def _effects_of(kind: str, rng: np.random.Generator) -> tuple[str, ...]:
    if kind == "plain_coulomb":
        return ()
    if kind in PAIR_KINDS:
        choices = pairs(kind)
        return choices[int(rng.integers(len(choices)))]
    if kind in (*KINDS, *CONTACT_AND_SENSOR):
        return (kind,)
    raise ValueError(f"unknown kind {kind!r}, one of {', '.join((*KINDS, *CONTACT_AND_SENSOR))}")


def _draw_motion(
    kind: str,
    effects: tuple[str, ...],
    strength: float,
    spp: float,
    rng: np.random.Generator,
    integrator: Integrator,
) -> tuple[dict[str, Any], Motion | DisturbedMotion, tuple[float, float], float] | None:
    """Draw law and start; None if the record would not contain the stated number of half cycles."""
    aimed = int(rng.integers(HALF_CYCLES[0], HALF_CYCLES[1] + 1))
    # "T" of a drifting friction must mean one thing, and a contact that springs back never sticks: those
    # records end before rest
    rests = bool(rng.random() < 0.5) and not {"friction_drift", "presliding"} & set(effects)
    final = 0.0 if rests else rng.uniform(0.15, 0.6)
    shares = {name: rng.uniform(0.02, 0.5) / len(effects) for name in effects}
    lost = sum(shares[name] for name in effects if name in {"viscous_damping", "quadratic_drag"})
    setting = Setting((1.0 - final) / (2.0 * aimed * (1.0 + lost)), final, math.pi * aimed, spp)
    drawn: dict[str, Any] = {}
    for name in effects:
        if kind in OUTSIDE:
            drawn |= draw_outside(name, rng, setting, strength)
        elif kind in CONTACT_AND_SENSOR:
            drawn |= draw_contact_or_sensor(name, rng, setting)
        else:
            drawn |= draw_effect(name, rng, setting, shares[name])
    mid_motion = bool(rng.random() < 0.5)
    phase = rng.uniform(0.0, 2.0 * math.pi) if mid_motion else math.pi * int(rng.integers(2))
    start = (math.cos(phase), -math.sin(phase) if mid_motion else 0.0)
    law = Law(
        friction=setting.friction,
        duration=setting.duration,
        **{key: value for key, value in drawn.items() if key in _LAW_FIELDS},
    )
    motion = integrator(law, *start, setting.duration * (2.5 if rests else 1.0), drawn)
    end = setting.duration
    if rests:
        if motion.rest_time is None:
            return None
        end = motion.rest_time * rng.uniform(1.02, 1.15)
    elif motion.rest_time is not None:
        return None
    if not HALF_CYCLES[0] <= motion.turning_times.size <= HALF_CYCLES[1]:
        return None
    return drawn | {"friction": setting.friction}, motion, start, end


def _draw_system(
    quantity: str, friction: float, swing: tuple[float, float], rng: np.random.Generator
) -> tuple[dict[str, float], float, float]:
    """Draw system, natural frequency [rad/s] and initial amplitude [m or rad]."""
    while True:
        frequency = 2.0 * math.pi * log_uniform(rng, *NATURAL_FREQUENCY_HZ)
        if quantity == "angle":
            moving, name = log_uniform(rng, *INERTIA_KG_M2), "inertia"
            amplitude = log_uniform(rng, *swing)
            plausible = True
        else:
            moving, name = log_uniform(rng, *MASS_KG), "mass"
            amplitude = log_uniform(rng, *AMPLITUDE_M)
            coefficient = friction * amplitude * frequency**2 / _GRAVITY
            plausible = FRICTION_COEFFICIENT[0] <= coefficient <= FRICTION_COEFFICIENT[1]
        if plausible:
            return {name: moving, "stiffness": moving * frequency**2}, frequency, amplitude


def _rms_slope(signal: NDArray[np.float64], times: NDArray[np.float64], stop: float) -> float:
    """Root mean square rate of change of the signal while the mass moves."""
    slope = np.gradient(signal, times)[times < stop]
    return float(np.sqrt(np.mean(slope**2)))


def _undisturbed(law: Law, x: float, v: float, end: float, _: dict[str, Any]) -> Motion:
    return integrate(law, x, v, end)


def draw(
    kind: str,
    seed: np.random.SeedSequence | int,
    *,
    strength: float = 1.0,
    integrator: Integrator = _undisturbed,
) -> SealedRecord:
    """Draw one record of a kind.

    Parameters
    ----------
    kind : str
        One of :data:`KINDS`, or of the contact and sensor.
    seed : SeedSequence or int
        Decides everything; the same seed with another ``strength`` draws the same record otherwise.
    strength : float
        Multiplies effects outside the catalogue.
    integrator : callable
        Law, start, end and drawn strengths to motion.

    Returns
    -------
    SealedRecord
        Draws that miss the stated number of half cycles are drawn again.
    """
    rng = np.random.default_rng(seed)
    effects = _effects_of(kind, rng)
    spp = float(rng.uniform(*SAMPLES_PER_PERIOD))
    attempt = None
    while attempt is None:
        attempt = _draw_motion(kind, effects, strength, spp, rng, integrator)
    drawn, motion, start, end = attempt
    quantity = str(rng.choice(_MEASURED_BY.get(kind, _QUANTITIES)))
    swing = WIDE_SWING_RAD if kind == "encoder_eccentricity" else AMPLITUDE_RAD
    if "swing" in drawn:  # the motion was integrated under a force that depends on the angle
        swing = (drawn["swing"], drawn["swing"])
    system, natural_frequency, amplitude = _draw_system(quantity, drawn["friction"], swing, rng)

    times = np.arange(0.0, end, 2.0 * math.pi / spp)
    x, acceleration = motion.sample(times)
    signal, unit = (
        (acceleration, amplitude * natural_frequency**2) if quantity == "acceleration" else (x, amplitude)
    )
    stop = end if motion.rest_time is None else motion.rest_time
    rms = float(np.sqrt(np.mean(signal[times < stop] ** 2)))
    clean = with_sensor(signal, times, rms, amplitude, drawn)
    snr = float(rng.uniform(*SIGNAL_TO_NOISE_DB))
    noise_sd = rms * 10.0 ** (-snr / 20.0)
    noise = rng.normal(0.0, noise_sd, times.size)
    if "outlier_fraction" in drawn:
        noise[rng.random(times.size) < drawn["outlier_fraction"]] *= drawn["outlier_scale"]
    measured = clean + noise
    if "jitter_over_noise" in drawn:
        drawn["timing_jitter"] = drawn["jitter_over_noise"] * noise_sd / _rms_slope(signal, times, stop)
        late = np.clip(times + rng.normal(0.0, drawn["timing_jitter"], times.size), 0.0, end)
        taken = motion.sample(late)[1 if quantity == "acceleration" else 0]
        measured = with_sensor(taken, times, rms, amplitude, drawn) + noise
    if "clipping" in drawn:
        level = drawn["clipping"] * float(np.max(np.abs(clean)))
        drawn["clipping_level"] = level
        clean = np.clip(clean, -level, level)
        measured = np.clip(measured, -level, level)
    turns = motion.turning_times
    truth = Truth(
        kind=kind,
        effects=tuple(_NAMES.get(name, name) for name in effects),
        visible=trace_of(tuple(_NAMES.get(name, name) for name in effects), quantity),
        outside=kind in OUTSIDE,
        friction=drawn["friction"] * amplitude * system["stiffness"],
        parameters=drawn,
        quantity=quantity,
        snr_db=snr,
        noise_sd=noise_sd * unit,
        half_cycles=int(turns.size),
        samples_per_period=spp,
        mid_motion=start[1] != 0.0,
        reaches_rest=motion.rest_time is not None,
    )
    return SealedRecord(
        record=make_record(
            times / natural_frequency, measured * unit, quantity, name="sealed record", synthetic=True
        ),
        system=system,
        natural_frequency=natural_frequency,
        truth=truth,
        times=times,
        clean=clean,
        noise_sd=noise_sd,
        motion=motion,
        start=start,
        frequency=math.pi * (turns.size - 1) / float(turns[-1] - turns[0]),
        rest_time=math.inf if motion.rest_time is None else motion.rest_time,
    )
