"""Synthetic records: the exact or integrated motion seen through a sensor."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite, non_negative, positive
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES, Quantity, quantity_named
from friction_bayes.core.system import Oscillator, check_system
from friction_bayes.mechanics.coulomb import coulomb_decay
from friction_bayes.mechanics.effects import (
    ForceEffect,
    NoiseEffect,
    SensorEffect,
    effect_named,
    parse_effects,
)
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.integrate import integrate
from friction_bayes.mechanics.motion import Motion
from friction_bayes.mechanics.random_process import RTOL, random_force_path
from friction_bayes.records.record import make_record

__all__ = ["digitised", "noise_sd_for", "signal_to_noise_db", "simulate"]

_MOST_SAMPLES = 10**8
"""A longer record is a typing error: it would not fit into memory."""


def signal_to_noise_db(signal: Array, noise_sd: float) -> float:
    """Signal-to-noise ratio: mean square of the moving noise-free signal over the noise variance [dB].

    Parameters
    ----------
    signal : ndarray, shape (n,)
        Noise-free signal while the system moves.
    noise_sd : float
        Standard deviation of the noise, same unit.

    Raises
    ------
    InputError
        If there is no noise, or no signal.
    """
    power = float(np.mean(np.square(signal))) if len(signal) else 0.0
    if power == 0.0:
        raise InputError("signal", "does not move", "give the samples before the stop")
    return 20.0 * math.log10(math.sqrt(power) / positive("noise_sd", noise_sd))


def noise_sd_for(signal: Array, decibels: float) -> float:
    """Standard deviation of the noise that gives :func:`signal_to_noise_db` a value."""
    return float(
        math.sqrt(float(np.mean(np.square(signal)))) * 10.0 ** (-finite("decibels", decibels) / 20.0)
    )


def simulate(
    system: Oscillator,
    *,
    friction: float,
    initial_displacement: float,
    initial_velocity: float = 0.0,
    duration: float,
    sampling_rate: float,
    quantity: str | None = None,
    noise_sd: float = 0.0,
    seed: int | None = None,
    effects: Mapping[str, float] | None = None,
    bits: int | None = None,
    sensor_range: float | None = None,
    name: str = "synthetic record",
) -> xr.DataArray:
    """Simulate the record of a free decay.

    The motion is exact where Coulomb friction acts alone on a linear system and integrated otherwise. The
    sensor adds its offset, drift and interference, then noise; then it clips, saturates at its range and is
    digitised.

    Parameters
    ----------
    system : Oscillator
        A pendulum too.
    friction : float
        Friction force [N] or torque [N m], not negative.
    initial_displacement, initial_velocity : float
        State at the first sample; any, so that a record may begin in mid-motion.
    duration : float
        Length [s]; the record holds ``round(duration * sampling_rate)`` samples from time 0.
    sampling_rate : float
        Samples per second [Hz].
    quantity : str, optional
        What the sensor measures; displacement, or angle of a rotational system, when left out.
    noise_sd : float
        Standard deviation of independent normal noise, SI unit of the quantity.
    seed : int, optional
        Seed of the noise; required where there is any.
    effects : mapping, optional
        ``{"NAME.PARAMETER": value}`` of effects of the catalogue.
    bits : int, optional
        Resolution of the digitiser over ``-sensor_range .. sensor_range``.
    sensor_range : float, optional
        Where the sensor saturates, to either side, SI unit of the quantity.
    name : str
        What messages call the record.

    Returns
    -------
    xarray.DataArray
        A record; attributes ``synthetic`` (True) and every setting; ``effects`` as JSON;
        ``stop_time`` [s] where the motion ends within the record; ``signal_to_noise_db`` where there is
        noise.

    Raises
    ------
    InputError
        If an argument is out of its range, or noise is asked for without a seed.
    """
    kind = _sensed(check_system(system), quantity)
    duration = positive("duration", duration)
    sampling_rate = positive("sampling_rate", sampling_rate)
    noise_sd = non_negative("noise_sd", noise_sd)
    full_scale = None if sensor_range is None else positive("sensor_range", sensor_range)
    if full_scale is None and bits is not None:
        raise InputError("bits", f"{bits} bits without a range", "give sensor_range too")
    values = parse_effects(effects)
    for effect in (effect_named(name) for name in values):
        if isinstance(effect, SensorEffect) and not effect.is_of(kind.name):
            others = " or ".join(effect.quantities)
            raise InputError(
                f"effect {effect.name}", f"does not apply to a sensor of {kind.name}", f"measure {others}"
            )
        if isinstance(effect, ForceEffect) and effect.rotational and not system.angular:
            raise InputError(
                f"effect {effect.name}", "acts on what turns, and this moves along a line", "give an inertia"
            )
    contaminations = [name for name in values if isinstance(effect_named(name), NoiseEffect)]
    if seed is None and (noise_sd > 0.0 or contaminations or RANDOM_FORCE.name in values):
        raise InputError("seed", "is missing although there is noise", "give an integer")
    samples = round(duration * sampling_rate)
    if samples < 1:
        raise InputError("duration", f"{duration:g} s holds no sample at {sampling_rate:g} Hz", "lengthen it")
    if samples > _MOST_SAMPLES:
        raise InputError(
            "duration",
            f"{duration:g} s at {sampling_rate:g} Hz are {samples:.2g} samples",
            f"give at most {_MOST_SAMPLES:.0e}: a shorter duration or a lower sampling rate",
        )

    time = np.arange(samples) / sampling_rate
    state = (initial_displacement, initial_velocity)
    driving = None
    if RANDOM_FORCE.name in values:
        period = 2.0 * math.pi / system.natural_frequency
        # a stream of its own: the noise is the same with and without
        rng = np.random.default_rng(seed).spawn(1)[0]
        sd, correlation_time = values[RANDOM_FORCE.name]
        driving = random_force_path(sd, correlation_time, duration, period, rng)
    motion = _motion(system, friction, state, time, effects, duration, driving)
    clean = motion.derivative(kind.order)
    noise = np.zeros(samples)
    if seed is not None:
        rng = np.random.default_rng(seed)
        noise = rng.normal(0.0, noise_sd, samples)
        rate = np.gradient(clean, time) if samples > 1 else np.zeros(1)
        for effect, numbers in ((effect_named(name), values[name]) for name in contaminations):
            assert isinstance(effect, NoiseEffect)
            noise = effect.contaminate(noise, clean, rate, rng, *numbers)
    signal = _distorted(clean, time, values, after_noise=False) + noise
    signal = _distorted(signal, time, values, after_noise=True)
    if full_scale is not None:
        signal = digitised(signal, full_scale, bits)

    settings: dict[str, Any] = {
        "synthetic": True,
        "inertia" if system.angular else "mass": system.moving,
        "stiffness": system.stiffness,
        "pendulum": system.pendulum,
        "friction": float(friction),
        "initial_displacement": float(initial_displacement),
        "initial_velocity": float(initial_velocity),
        "duration": duration,
        "sampling_rate": sampling_rate,
        "noise_sd": noise_sd,
        "effects": json.dumps({key: float(value) for key, value in (effects or {}).items()}),
    }
    optional = {"seed": seed, "bits": bits, "sensor_range": full_scale}
    settings |= {key: value for key, value in optional.items() if value is not None}
    if math.isfinite(motion.stop_time):
        settings["stop_time"] = motion.stop_time
    if noise_sd > 0.0 and np.any(clean[motion.moving]):
        settings["signal_to_noise_db"] = signal_to_noise_db(clean[motion.moving], noise_sd)
    return make_record(time, signal, kind.name, name=name, **settings)


def _sensed(system: Oscillator, quantity: str | None) -> Quantity:
    kind = quantity_named(quantity or ("angle" if system.angular else "displacement"))
    if kind.angular != system.angular:
        choices = ", ".join(q.name for q in QUANTITIES.values() if q.angular == system.angular)
        raise InputError("quantity", f"{kind.name} does not belong to this system", f"give one of {choices}")
    return kind


def _motion(
    system: Oscillator,
    friction: float,
    state: tuple[float, float],
    time: Array,
    effects: Mapping[str, float] | None,
    duration: float,
    driving: tuple[float, Array] | None,
) -> Motion:
    forces = {
        key: value
        for key, value in (effects or {}).items()
        if isinstance(effect_named(key.partition(".")[0]), ForceEffect)
    }
    if driving is not None:
        return integrate(
            system, friction, *state, time, forces, duration=duration, driving=driving, rtol=RTOL
        )
    if not forces and not system.pendulum:
        return coulomb_decay(system, friction, *state, time)
    return integrate(system, friction, *state, time, forces, duration=duration)


def _distorted(
    signal: Array, time: Array, values: Mapping[str, tuple[float, ...]], *, after_noise: bool
) -> Array:
    for effect, numbers in ((effect_named(name), numbers) for name, numbers in values.items()):
        if isinstance(effect, SensorEffect) and effect.after_noise == after_noise:
            signal = effect.distort(signal, time, *numbers)
    return signal


def digitised(signal: Array, full_scale: float, bits: int | None) -> Array:
    """Saturate a signal, and round it to the codes of a two's complement digitiser.

    Parameters
    ----------
    signal : ndarray, shape (n,)
    full_scale : float
        Where it saturates, to either side, in the unit of the signal.
    bits : int or None
        Resolution over ``-full_scale .. full_scale``; None where the signal stays analogue.

    Raises
    ------
    InputError
        If ``bits`` is no whole number from 2 to 32.
    """
    if bits is None:
        return np.clip(signal, -full_scale, full_scale)
    if not (isinstance(bits, int) and 2 <= bits <= 32):
        raise InputError("bits", f"{bits!r} is not a resolution", "give a whole number from 2 to 32")
    codes = 2 ** (bits - 1)
    return np.clip(np.rint(signal / full_scale * codes), -codes, codes - 1) * (full_scale / codes)
