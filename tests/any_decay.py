"""Records drawn from the whole catalogue: any effect, any sensor, begun at the release or in mid-motion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import xarray as xr

import friction_bayes as fb
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.mechanics.effects import EFFECTS, Scales

__all__ = ["AnyDecay", "any_decay"]


class AnyDecay(NamedTuple):
    """A drawn record.

    Attributes
    ----------
    record : xarray.DataArray
    system : Oscillator
    what : str
        How it was drawn, for messages.
    """

    record: xr.DataArray
    system: fb.Oscillator
    what: str


def any_decay(name: str, quantity: str, rng: np.random.Generator) -> AnyDecay:
    """Draw a record with an effect, of sizes that its prior has, as a sensor of a quantity reads it.

    Of 3 to 15 periods, 12 to 250 samples each at 50 Hz to 5 kHz, 300 to 1500 in all; half of them begin in
    mid-motion, an eighth have no noise, and a quarter is digitised. Friction takes a third to all of the
    amplitude, so that some come to rest.

    Raises
    ------
    InputError
        If no sensor of that quantity has the effect, or it does not act on such a system.
    """
    per_period, periods = _between(rng, 12.0, 250.0), _between(rng, 3.0, 15.0)
    periods = min(max(periods, 300.0 / per_period), 1500.0 / per_period)
    rate = _between(rng, max(50.0, 0.3 * per_period), 5000.0)
    frequency = rate / per_period
    moving = _between(rng, 0.01, 10.0)
    stiffness = moving * (2.0 * math.pi * frequency) ** 2
    if QUANTITIES[quantity].angular:
        kind = fb.Pendulum if rng.random() < 0.3 else fb.Oscillator
        system = kind(inertia=moving, stiffness=stiffness)
        amplitude = _between(rng, 0.05, 2.0)
    else:
        system = fb.Oscillator(mass=moving, stiffness=stiffness)
        amplitude = _between(rng, 1e-4, 0.1)
    friction = rng.uniform(0.3, 1.0) * stiffness * amplitude / (4.0 * periods)
    scales = Scales(
        system=system,
        quantity=QUANTITIES[quantity],
        amplitude=amplitude,
        duration=periods / frequency,
        sampling_rate=rate,
    )
    effect = EFFECTS[name]
    drawn = [prior.distribution.rvs(random_state=rng) for prior in effect.priors(scales)]
    # an encoder or a converter: the swing is 30 to 4000 steps
    bits = int(rng.integers(5, 13)) if rng.random() < 0.25 else None
    noise = 0.0 if rng.random() < 0.125 else _between(rng, 1e-4, 0.05) * scales.signal
    begins = rng.uniform(0.0, 1.0) if rng.random() < 0.5 else 0.0
    record = fb.simulate(
        system,
        friction=friction,
        initial_displacement=amplitude * math.cos(2.0 * math.pi * begins),
        initial_velocity=-scales.velocity * math.sin(2.0 * math.pi * begins),
        duration=scales.duration,
        sampling_rate=rate,
        quantity=quantity,
        noise_sd=noise,
        seed=int(rng.integers(2**31)),
        bits=bits,
        sensor_range=None if bits is None else 2.0 * scales.signal,
        effects={f"{name}.{p.name}": float(v) for p, v in zip(effect.parameters, drawn, strict=True)},
    )
    sizes = ", ".join(f"{p.name} {v:.4g}" for p, v in zip(effect.parameters, drawn, strict=True))
    what = (
        f"{name} ({sizes}), {quantity}, {record.size} samples of {rate:.4g} Hz, {per_period:.3g} a period, "
        f"begun at {begins:.2f}, noise {noise / scales.signal:.2g}, {bits} bits, pendulum {system.pendulum}"
    )
    return AnyDecay(record, system, what)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Uniform in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
