"""A synthetic twin of the paper's testbed with all its sensors, section 4 and Fig. 5.

What the paper states is taken as stated. What it does not state is chosen here, once, with its reason, and
varied by :mod:`experiments.testbed_choices`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.signal import lfilter, savgol_filter

from experiments.varying_friction import varying_friction_decay
from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.quantities import STANDARD_GRAVITY
from friction_bayes.core.system import Oscillator
from friction_bayes.mechanics.simulate import digitised
from friction_bayes.mechanics.testbed import TESTBED, TESTBED_FREQUENCY, TESTBED_RELEASE, TESTBED_SPAN
from friction_bayes.records.record import make_record

__all__ = [
    "Rig",
    "measured_reference",
    "plateaus",
    "refined_force",
    "run_rig",
    "system_of",
    "true_friction",
]


@dataclass(frozen=True)
class Rig:
    """The testbed; the paper states the first block, the second is our choice.

    Attributes
    ----------
    natural_frequency : float
        [Hz].
    sampling_rate, bits
        Of the acquisition card [Hz]; its range is taken as that of the sensor.
    accelerometer_noise, accelerometer_range : float
        ADXL322 [g].
    phase_error : float
        Of the accelerometer chain at the natural frequency [deg]; a delay, as a low-pass filter has.
    load_cell_range : float
        To either side [N].
    displacement_range, displacement_linearity : float
        Span [m], and largest deviation from a straight line over the span.
    burst_times : tuple of float
        When friction departs from Coulomb's law most, Fig. 6 [s].
    mass, release : float
        [kg], and initial displacement [m]; see :mod:`friction_bayes.mechanics.testbed`.
    roughness, roughness_time : float
        Standard deviation of the friction about its mean, relative, and its correlation time [s]: a scratched
        plate; "considerable" in the words of the paper.
    burst_sizes, burst_duration
        Relative size of each departure, and their duration [s]. The sizes leave the mean as it is: they were
        0.6 up and down in turn before a first look, which raised it.
    load_cell_noise, displacement_noise : float
        [N], [m]: one per cent of the cell's range, and the sensor's resolution.
    filter_window, filter_order : int
        Of the Savitzky-Golay filter that refines the friction signal [samples].
    duration : float
        Length of a record [s], longer than the motion.
    """

    natural_frequency: float = TESTBED_FREQUENCY
    sampling_rate: float = 1000.0
    bits: int = 16
    accelerometer_noise: float = 6.2e-3
    accelerometer_range: float = 2.0
    phase_error: float = 0.35
    load_cell_range: float = 1.0
    displacement_range: float = TESTBED_SPAN
    displacement_linearity: float = 0.004
    burst_times: tuple[float, ...] = (3.8, 4.0, 4.5)

    mass: float = TESTBED.moving
    release: float = TESTBED_RELEASE
    roughness: float = 0.15
    roughness_time: float = 0.02
    burst_sizes: tuple[float, ...] = (0.5, -0.8, 0.3)
    burst_duration: float = 0.06
    load_cell_noise: float = 0.01
    displacement_noise: float = 3e-5
    filter_window: int = 31
    filter_order: int = 3
    duration: float = 13.0


def system_of(rig: Rig) -> Oscillator:
    """The declared system: what a set-up phase on a long record would give."""
    return Oscillator(mass=rig.mass, stiffness=rig.mass * (2.0 * math.pi * rig.natural_frequency) ** 2)


def _friction_level(rig: Rig, friction: float, time: Array, rng: np.random.Generator) -> Array:
    """Size of the friction force at each sample [N]: its mean, a correlated scatter, and the departures."""
    keep = math.exp(-1.0 / (rig.roughness_time * rig.sampling_rate))
    white = rng.standard_normal(time.size)
    scatter = lfilter([math.sqrt(1.0 - keep**2)], [1.0, -keep], white)
    relative = 1.0 + rig.roughness * scatter
    for at, size in zip(rig.burst_times, rig.burst_sizes, strict=True):
        relative += size * np.exp(-0.5 * ((time - at) / (0.5 * rig.burst_duration)) ** 2)
    return friction * np.maximum(relative, 0.0)


def run_rig(rig: Rig, friction: float, *, seed: int, damping_ratio: float = 0.0) -> dict[str, xr.DataArray]:
    """One synthetic run of the testbed: what its three sensors record.

    Parameters
    ----------
    rig : Rig
    friction : float
        Mean friction [N].
    seed : int
        Of friction and sensors.
    damping_ratio : float
        Of viscous damping in addition to the friction, which the paper calls extremely small.

    Returns
    -------
    dict
        ``acceleration`` [m/s2], ``displacement`` [m] and ``friction_force`` [N], each over ``time`` with the
        attributes ``synthetic``, ``friction``, ``stop_time`` [s] and ``seed``; and the truth behind them,
        ``level``, the size of the friction force while it moves, zero at rest [N].
    """
    rng = np.random.default_rng(seed)
    system = system_of(rig)
    step = 1.0 / rig.sampling_rate
    time = step * np.arange(round(rig.duration * rig.sampling_rate))
    delay = math.radians(rig.phase_error) / system.natural_frequency
    # the accelerometer sees the motion of a moment ago: both clocks are marched through at once
    clocks = np.concatenate([time, np.maximum(time[1:] - delay, 0.0)])
    order = np.argsort(clocks, kind="stable")
    level = _friction_level(rig, friction, time, rng)
    held = level[np.minimum((clocks[order] * rig.sampling_rate + 1e-9).astype(np.int64), time.size - 1)]
    motion, force = varying_friction_decay(
        system, held, rig.release, 0.0, clocks[order], damping_ratio=damping_ratio
    )
    place = np.empty_like(order)
    place[order] = np.arange(order.size)
    now = place[: time.size]
    before = np.concatenate([now[:1], place[time.size :]])

    gravity, span = STANDARD_GRAVITY, rig.displacement_range
    x = motion.displacement[now]
    # a bow over the span, its ends and its middle off by the stated linearity, the motion about its middle
    bowed = x + rig.displacement_linearity * span * (1.0 - 2.0 * (2.0 * x / span) ** 2)
    acceleration = motion.acceleration[before] + rng.normal(0.0, rig.accelerometer_noise * gravity, time.size)
    displacement = bowed + rng.normal(0.0, rig.displacement_noise, time.size)
    friction_force = force[now] + rng.normal(0.0, rig.load_cell_noise, time.size)
    moving = time < motion.stop_time
    settings = {"synthetic": True, "friction": friction, "seed": seed, "stop_time": motion.stop_time}
    cell = digitised(friction_force, rig.load_cell_range, rig.bits)
    return {
        "acceleration": make_record(
            time,
            digitised(acceleration, rig.accelerometer_range * gravity, rig.bits),
            "acceleration",
            name="testbed, acceleration (synthetic)",
            **settings,
        ),
        "displacement": make_record(
            time,
            digitised(displacement, 0.5 * span, rig.bits),
            "displacement",
            name="testbed, displacement (synthetic)",
            **settings,
        ),
        "friction_force": xr.DataArray(
            cell, dims="time", coords={"time": time}, attrs={"units": "N", **settings}, name="friction force"
        ),
        "level": xr.DataArray(
            np.where(moving, level, 0.0), dims="time", coords={"time": time}, attrs={"units": "N", **settings}
        ),
    }


def true_friction(run: Mapping[str, xr.DataArray], since: float = 0.0) -> float:
    """Mean friction that a run had from ``since`` [s] until it came to rest [N]."""
    level = run["level"]
    taken = level.values[(level["time"].values >= since) & (level.values > 0.0)]
    return float(taken.mean())


def refined_force(rig: Rig, force: xr.DataArray) -> Array:
    """The friction signal after the Savitzky-Golay filter [N]."""
    return np.asarray(savgol_filter(force.values, rig.filter_window, rig.filter_order))


def plateaus(rig: Rig, force: xr.DataArray) -> tuple[Indices, Array]:
    """Samples of the motion that are no reversal, and the size of the refined force there [N].

    The filter smears the change of sign over half its window; samples that near to one are no plateau.
    """
    refined = refined_force(rig, force)
    reach = rig.filter_window // 2
    reversal = np.zeros(refined.size, dtype=bool)
    for change in np.flatnonzero(np.diff(np.signbit(refined))):
        reversal[max(change - reach, 0) : change + reach + 2] = True
    reversal[:reach] = True
    kept = np.flatnonzero((force["time"].values < force.attrs["stop_time"]) & ~reversal)
    return kept, np.abs(refined[kept])


def measured_reference(rig: Rig, force: xr.DataArray) -> float:
    """Reference friction [N]: mean size of the refined signal of the load cell."""
    return float(plateaus(rig, force)[1].mean())
