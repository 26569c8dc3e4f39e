"""Records of decays under a fluctuating force, read by sensors with faults, and fits along their motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr
from scipy.signal import lfilter

import friction_bayes as fb
from fluctuating_force import fluctuating_decay
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.record_fit import ForceFit, fit_random_force

# It swings at 10 rad/s.
SYSTEM = fb.Oscillator(mass=1.0, stiffness=100.0)
WHEEL = fb.Oscillator(inertia=1.0, stiffness=100.0)
STEP, RELEASE, FRICTION = 0.02, 0.02, 0.0002
"""Sampling interval [s], amplitude and friction over the stiffness [m]."""
FINE = 0.01
"""Sampling interval of records with lines [s], which show up to 50 Hz."""
WHEEL_NOISE, WHEEL_RELEASE = 2.1e-4, 2.5
"""In rad."""
WHITE, ERROR, ERROR_TIME = 1.4e-5, 5.6e-5, 0.04
"""Noise of a sensor, four times as much that neighbouring samples share [m], and for how long [s]."""
RINGING = 4.3
"""Of a second mode [Hz]."""
QUANTITIES = ("displacement", "velocity", "acceleration")


def unsteady_motion(
    rng: np.random.Generator,
    force: float = 0.2,
    *,
    samples: int = 750,
    step: float = STEP,
    rub: Callable[[float], float] | None = None,
    knock: Callable[[float], float] | None = None,
) -> dict[int, np.ndarray]:
    """Motion by order of derivative; the force is a share of friction and correlated over 0.1 s.

    What knocks at a time is in frictions.
    """
    return fluctuating_decay(
        rng,
        frequency=10.0,
        friction=FRICTION,
        release=RELEASE,
        step=step,
        samples=samples,
        force_sd=force * FRICTION,
        correlation_time=0.1,
        rub=rub,
        knock=None if knock is None else lambda t: FRICTION * knock(t),
    )


def sensed(values: np.ndarray, order: int = 0, step: float = STEP) -> xr.DataArray:
    """Record of a derivative of the displacement."""
    return fb.make_record(step * np.arange(values.size), values, QUANTITIES[order])


def faulty_record(
    rng: np.random.Generator,
    *,
    force: float,
    noise: float,
    order: int = 0,
    hit: float = 0.0,
    far: float = 15.0,
    ceiling: float = np.inf,
    growing: float = 0.0,
) -> tuple[xr.DataArray, np.ndarray, np.ndarray]:
    """Record of a decay, what a sensor without noise would show, and which samples are outliers.

    Noise and ceiling are lengths. A share ``hit`` of the samples has ``far`` times the noise; noise in
    proportion to the signal is ``growing`` times the other at the release.
    """
    unit = 10.0**order
    motion = unsteady_motion(rng, force)[order]
    outlying = rng.random(motion.size) < hit
    off = unit * noise * np.where(outlying, far, 1.0) * rng.standard_normal(motion.size)
    if growing > 0.0:
        off += growing * noise / RELEASE * motion * rng.standard_normal(motion.size)
    return sensed(np.clip(motion + off, -unit * ceiling, unit * ceiling), order), motion, outlying


def jittered_record(rng: np.random.Generator, jitter: float, noise: float, order: int = 0) -> xr.DataArray:
    """Record of a decay whose samples are taken early or late with an sd of ``jitter`` [s]."""
    motion = unsteady_motion(rng)
    # moved along the tangent: the third term is below a hundredth of the noise
    late = jitter * rng.standard_normal(motion[0].size)
    off = noise * 10.0**order * rng.standard_normal(motion[0].size)
    return sensed(motion[order] + late * motion[order + 1] + off, order)


def correlated_record(rng: np.random.Generator, error: float, force: float = 0.2) -> xr.DataArray:
    """Record of a decay; the sensor errs by ``error`` [m] alike in neighbouring samples, and white."""
    motion = unsteady_motion(rng, force)[0]
    memory = math.exp(-STEP / ERROR_TIME)
    kicks = math.sqrt(1.0 - memory**2) * rng.standard_normal(motion.size + 100)
    shared = lfilter([1.0], [1.0, -memory], kicks)[100:]
    return sensed(motion + WHITE * rng.standard_normal(motion.size) + error * shared)


def eccentric_record(
    rng: np.random.Generator,
    size: float,
    phases: tuple[float, float] = (0.7, -1.0),
    *,
    release: float = WHEEL_RELEASE,
) -> xr.DataArray:
    """Record of a wheel between springs; its encoder errs once a turn and half as much twice a turn."""
    angle = _turning(rng, release)
    read = angle + size * (np.sin(angle + phases[0]) + 0.5 * np.sin(2.0 * angle + phases[1]))
    return _angle_read(rng, read)


def unbalanced_record(
    rng: np.random.Generator,
    size: float,
    phases: tuple[float, float] = (0.7, -1.0),
    *,
    release: float = WHEEL_RELEASE,
) -> xr.DataArray:
    """Record of a wheel pulled by ``size`` of friction once a turn and by half as much three times a turn."""

    def pull(x: float) -> float:
        return size * release / 100.0 * (math.sin(x + phases[0]) + 0.5 * math.sin(3.0 * x + phases[1]))

    return _angle_read(rng, _turning(rng, release, pull))


def bent_record(
    rng: np.random.Generator, curvature: float, order: int = 0, *, cubic: float = 0.0
) -> xr.DataArray:
    """Record of a decay by a sensor whose scale is bent: by shares of the signal at the release."""
    motion = unsteady_motion(rng)[order] / (RELEASE * 10.0**order)
    bent = motion + curvature * motion**2 + cubic * motion**3
    read = bent + WHITE / RELEASE * rng.standard_normal(motion.size)
    return sensed(RELEASE * 10.0**order * read, order)


def ringing_record(rng: np.random.Generator, size: float, decay_time: float, order: int = 0) -> xr.DataArray:
    """Record of a decay and of a line of 4.3 Hz next to it; ``size`` is a share of the release.

    The line is as large at the beginning, and steady if its decay time [s] is infinite.
    """
    motion = unsteady_motion(rng, samples=1500, step=FINE)[order] / (RELEASE * 10.0**order)
    time = FINE * np.arange(motion.size)
    ringing = size * np.exp(-time / decay_time) * np.sin(2.0 * np.pi * RINGING * time + 0.4)
    read = motion + ringing + WHITE / RELEASE * rng.standard_normal(motion.size)
    return sensed(RELEASE * 10.0**order * read, order, FINE)


def rubbed_record(rng: np.random.Generator, slope: float, curvature: float) -> xr.DataArray:
    """Record of a decay under a friction of ``1 + slope z + curvature z^2``, ``z`` over the release."""
    motion = unsteady_motion(rng, rub=lambda x: 1.0 + (slope + curvature * x / RELEASE) * x / RELEASE)[0]
    return sensed(motion + WHITE * rng.standard_normal(motion.size))


def _turning(
    rng: np.random.Generator, release: float, pull: Callable[[float], float] | None = None
) -> np.ndarray:
    return fluctuating_decay(
        rng,
        frequency=10.0,
        friction=release / 100.0,
        release=release,
        step=STEP,
        samples=750,
        force_sd=release / 1000.0,
        correlation_time=0.1,
        pull=pull,
    )[0]


def _angle_read(rng: np.random.Generator, angle: np.ndarray) -> xr.DataArray:
    read = angle + WHEEL_NOISE * rng.standard_normal(angle.size)
    return fb.make_record(STEP * np.arange(angle.size), read, "angle")


def fitted(record: xr.DataArray, effects: Sequence[str], system: fb.Oscillator = SYSTEM) -> ForceFit:
    """Fit a record along its motion, with these effects allowed."""
    (segment,) = cut_records([record], system)
    fit = fit_random_force(segment, system, (*effects, "random_force"))
    assert fit is not None
    return fit


def probability_of(fit: ForceFit, name: str) -> float:
    """Probability that an effect of the law acts."""
    inside = np.array([name in names for names in fit.sets])
    return float(fit.posterior.weight[:, inside].sum())
