"""Draw a record with a sealed truth: what the loop is given, and what it must find out, in two objects."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.blind.draws import CATALOGUE, OUTSIDE, Setting, draw_effect, draw_outside, log_uniform, pairs
from experiments.blind.laws import Law, Motion, integrate
from friction_bayes import make_record

__all__ = ["KINDS", "PAIR_KINDS", "SealedRecord", "Truth", "draw", "trace_of"]

PAIR_KINDS = ("two_forces", "force_and_sensor", "two_sensors")
KINDS = ("plain_coulomb", *CATALOGUE, *PAIR_KINDS, *OUTSIDE)

HALF_CYCLES = (36, 90)
SIGNAL_TO_NOISE_DB = (22.0, 34.0)
SAMPLES_PER_PERIOD = (60.0, 250.0)
NATURAL_FREQUENCY_HZ = (0.2, 50.0)
AMPLITUDE_M = (1e-4, 0.1)
AMPLITUDE_RAD = (0.02, 0.6)
MASS_KG = (0.05, 500.0)
INERTIA_KG_M2 = (1e-4, 10.0)
FRICTION_COEFFICIENT = (1e-5, 0.3)
"""Of the weight, for linear systems: what no bearing has is not drawn."""

_GRAVITY = 9.80665
_LAW_FIELDS = frozenset(Law.__dataclass_fields__)


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What the loop must find out.

    Attributes
    ----------
    kind : str
        One of :data:`KINDS`.
    effects : tuple of str
        Effects at work, whether or not they leave a trace.
    visible : tuple of str
        Effects that leave a trace in the measured quantity (see :func:`trace_of`).
    outside : bool
        Whether the effect is outside the catalogue.
    friction : float
        Sliding friction [N or N m].
    parameters : dict
        Dimensionless strengths, as drawn.
    quantity : str
        What is measured.
    snr_db, noise_sd : float
        Mean square of the moving, fault-free signal over the noise variance [dB]; noise [SI].
    half_cycles : int
        In the record.
    samples_per_period : float
        Sampling rate over natural frequency.
    mid_motion, reaches_rest : bool
        Whether the record begins in mid-motion, and whether it goes on into the rest.
    """

    kind: str
    effects: tuple[str, ...]
    visible: tuple[str, ...]
    outside: bool
    friction: float
    parameters: dict[str, Any]
    quantity: str
    snr_db: float
    noise_sd: float
    half_cycles: int
    samples_per_period: float
    mid_motion: bool
    reaches_rest: bool

    def to_dict(self) -> dict[str, Any]:
        """Plain values, for a file kept apart from the record."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class SealedRecord:
    """A synthetic record for the loop, its system, and what only the judge may open.

    Attributes
    ----------
    record : xarray.DataArray
        The measurement.
    system : dict
        ``mass`` or ``inertia`` and ``stiffness``, SI.
    truth : Truth
        The seal.
    times, clean : ndarray, shape (n,)
        Dimensionless times, and the signal without noise and outliers but with the other sensor faults,
        in ``A`` or ``A w0**2``.
    noise_sd : float
        In the same unit as ``clean``.
    law, start : Law, tuple of float
        Dimensionless law, initial displacement and velocity.
    frequency : float
        Mean frequency of the motion over the natural one.
    rest_time : float
        Dimensionless; infinite where the record ends before rest.
    """

    record: xr.DataArray
    system: dict[str, float]
    truth: Truth
    times: NDArray[np.float64]
    clean: NDArray[np.float64]
    noise_sd: float
    law: Law
    start: tuple[float, float]
    frequency: float
    rest_time: float


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
    if kind in KINDS:
        return (kind,)
    raise ValueError(f"unknown kind {kind!r}, one of {', '.join(KINDS)}")


def _draw_motion(
    kind: str, effects: tuple[str, ...], strength: float, spp: float, rng: np.random.Generator
) -> tuple[dict[str, Any], Motion, tuple[float, float], float] | None:
    """Draw law and start; None if the record would not hold the stated number of half cycles."""
    aimed = int(rng.integers(HALF_CYCLES[0], HALF_CYCLES[1] + 1))
    # "T" of a drifting friction must mean one thing: those records end before rest
    rests = bool(rng.random() < 0.5) and "friction_drift" not in effects
    final = 0.0 if rests else rng.uniform(0.15, 0.6)
    shares = {name: rng.uniform(0.02, 0.5) / len(effects) for name in effects}
    lost = sum(shares[name] for name in effects if name in {"viscous_damping", "quadratic_drag"})
    setting = Setting((1.0 - final) / (2.0 * aimed * (1.0 + lost)), final, math.pi * aimed, spp)
    drawn: dict[str, Any] = {}
    for name in effects:
        if kind in OUTSIDE:
            drawn |= draw_outside(name, rng, setting, strength)
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
    motion = integrate(law, *start, setting.duration * (2.5 if rests else 1.0))
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
    quantity: str, friction: float, rng: np.random.Generator
) -> tuple[dict[str, float], float, float]:
    """Draw system, natural frequency [rad/s] and initial amplitude [m or rad]."""
    while True:
        frequency = 2.0 * math.pi * log_uniform(rng, *NATURAL_FREQUENCY_HZ)
        if quantity == "angle":
            moving, name = log_uniform(rng, *INERTIA_KG_M2), "inertia"
            amplitude = log_uniform(rng, *AMPLITUDE_RAD)
            plausible = True
        else:
            moving, name = log_uniform(rng, *MASS_KG), "mass"
            amplitude = log_uniform(rng, *AMPLITUDE_M)
            coefficient = friction * amplitude * frequency**2 / _GRAVITY
            plausible = FRICTION_COEFFICIENT[0] <= coefficient <= FRICTION_COEFFICIENT[1]
        if plausible:
            return {name: moving, "stiffness": moving * frequency**2}, frequency, amplitude


def _with_sensor(
    signal: NDArray[np.float64], times: NDArray[np.float64], rms: float, drawn: dict[str, Any]
) -> NDArray[np.float64]:
    """Add what a sensor adds, noise, clipping and outliers apart."""
    out = signal + rms * drawn.get("offset", 0.0) + rms * drawn.get("drift", 0.0) * times / times[-1]
    if "interference_amplitude" in drawn:
        angle = drawn["interference_frequency"] * times + drawn["interference_phase"]
        out += rms * drawn["interference_amplitude"] * np.sin(angle)
    if "mode_amplitude" in drawn:
        envelope = rms * drawn["mode_amplitude"] * np.exp(-drawn["mode_decay"] * times)
        out += envelope * np.cos(drawn["mode_frequency"] * times + drawn["mode_phase"])
    return out


def draw(kind: str, seed: np.random.SeedSequence | int, *, strength: float = 1.0) -> SealedRecord:
    """Draw one record of a kind.

    Parameters
    ----------
    kind : str
        One of :data:`KINDS`.
    seed : SeedSequence or int
        Decides everything; the same seed with another ``strength`` draws the same record otherwise.
    strength : float
        Multiplies effects outside the catalogue.

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
        attempt = _draw_motion(kind, effects, strength, spp, rng)
    drawn, motion, start, end = attempt
    quantity = str(rng.choice(("displacement", "acceleration", "angle")))
    system, natural_frequency, amplitude = _draw_system(quantity, drawn["friction"], rng)

    times = np.arange(0.0, end, 2.0 * math.pi / spp)
    x, acceleration = motion.sample(times)
    signal, unit = (
        (acceleration, amplitude * natural_frequency**2) if quantity == "acceleration" else (x, amplitude)
    )
    stop = end if motion.rest_time is None else motion.rest_time
    rms = float(np.sqrt(np.mean(signal[times < stop] ** 2)))
    clean = _with_sensor(signal, times, rms, drawn)
    snr = float(rng.uniform(*SIGNAL_TO_NOISE_DB))
    noise_sd = rms * 10.0 ** (-snr / 20.0)
    noise = rng.normal(0.0, noise_sd, times.size)
    if "outlier_fraction" in drawn:
        noise[rng.random(times.size) < drawn["outlier_fraction"]] *= drawn["outlier_scale"]
    measured = clean + noise
    if "clipping" in drawn:
        level = drawn["clipping"] * float(np.max(np.abs(clean)))
        drawn["clipping_level"] = level
        clean = np.clip(clean, -level, level)
        measured = np.clip(measured, -level, level)
    turns = motion.turning_times
    truth = Truth(
        kind=kind,
        effects=effects,
        visible=trace_of(effects, quantity),
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
        truth=truth,
        times=times,
        clean=clean,
        noise_sd=noise_sd,
        law=motion.law,
        start=start,
        frequency=math.pi * (turns.size - 1) / float(turns[-1] - turns[0]),
        rest_time=math.inf if motion.rest_time is None else motion.rest_time,
    )
