"""Effects from far below to far above what can be seen: one rig, and kinds that imitate others.

The rig and its sensor are the same in every record; only the size of the effect is drawn, log-uniform from a
hundredth of what can be seen upward. Dimensionless as :mod:`experiments.blind.laws`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.blind.disturbed_motion import integrate_disturbed
from experiments.blind.draws import either_sign, log_uniform
from experiments.blind.laws import Law, integrate
from experiments.blind.sensor_faults import with_sensor
from friction_bayes import make_record

__all__ = [
    "AMPLITUDE",
    "DISSIPATION",
    "DURATION",
    "FREQUENCY",
    "FRICTION",
    "KINDS",
    "NOISE",
    "PLAIN",
    "SAMPLING_RATE",
    "SIZES",
    "SYSTEM",
    "ImitatingEffect",
    "ThresholdRecord",
    "draw_effect_of_size",
    "draw_near_threshold",
    "sampled",
]

SYSTEM = {"mass": 10.0, "stiffness": 1000.0}
FRICTION = 0.07
AMPLITUDE = 0.0147
NOISE = 2e-4
DURATION = 14.0
SAMPLING_RATE = 200.0

FREQUENCY = math.sqrt(SYSTEM["stiffness"] / SYSTEM["mass"])
DISSIPATION = FRICTION / (SYSTEM["stiffness"] * AMPLITUDE)
_STEP = 0.01

Array = NDArray[np.float64]

SIZES = {
    "presliding": (0.0035, 0.05),
    "stiffness_drift": (5e-4, 0.05),
    "gain_drift": (0.035, 0.3),
    "quadratic_stiffness": (0.0015, 0.1),
    "sticking_turns": (0.006, 0.1),
    "position_friction": (0.4, 0.8),
    "one_sided_stop": (0.004, 0.3),
    "second_mode": (0.006, 0.15),
    "touch": (0.7, 30.0),
    "slight_damping": (4.5e-4, 3e-3),
    "cancelling_pair": (1.5e-3, 3e-3),
}
"""For each kind the size that can just be seen, and the largest that is drawn.

Seen: what a Coulomb decay with free start, frequency, friction and zero leaves of the clean signal is three
standard deviations of the noise, as the Euclidean length over all samples.
"""
PLAIN = "plain_coulomb"
KINDS = (PLAIN, *SIZES)


@dataclass(frozen=True, kw_only=True)
class ImitatingEffect:
    """An effect of one size.

    Attributes
    ----------
    law, sensor : dict
        Fields of :class:`experiments.blind.laws.Law`, and strengths of
        :func:`experiments.blind.sensor_faults.with_sensor`.
    pause : float
        How long the mass sticks at each turning point.
    touch : tuple of float
        Force, middle and length of a touch.
    """

    law: dict[str, float] = field(default_factory=dict)
    sensor: dict[str, float] = field(default_factory=dict)
    pause: float = 0.0
    touch: tuple[float, float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class ThresholdRecord:
    """Records, and what only the judge may open.

    Attributes
    ----------
    records : tuple of xarray.DataArray
        One, or two releases of the machine.
    kind : str
    size : float
        Of the effect, as :func:`draw_effect_of_size` measures it; zero where there is none.
    declared : dict
        Mass and stiffness that are declared.
    """

    records: tuple[xr.DataArray, ...]
    kind: str
    size: float
    declared: dict[str, float] = field(default_factory=SYSTEM.copy)


def draw_effect_of_size(kind: str, size: float, rng: np.random.Generator) -> ImitatingEffect:
    """Draw what else an effect of a size has.

    Sizes
    -----
    presliding
        Displacement over which friction builds up again, in initial amplitudes.
    stiffness_drift, gain_drift
        Relative change over the record, of either sign.
    quadratic_stiffness
        Force of ``x|x|`` at the initial amplitude over that of the spring, of either sign.
    sticking_turns
        Time for which the mass sticks at each turning point, in radians of the motion.
    position_friction
        Relative change of friction from the middle to the initial amplitude: on one side more and on the
        other less, or the same on both sides; of either sign.
    one_sided_stop
        Its stiffness over the spring's; the gap is uniform 0.3 .. 0.8 of the initial amplitude.
    second_mode
        Its amplitude over the motion's root mean square; frequency 1.7 .. 6 natural frequencies, decaying
        by e within 0.05 .. 0.3 of the record.
    touch
        Its largest force over friction; it swells and fades within 0.3 .. 2 periods, in the middle 0.3 .. 0.7
        of the record.
    slight_damping
        Viscous damping ratio.
    cancelling_pair
        The same, with friction that rises by 0.5 .. 1.5 of what makes up for the falling loss.
    """
    end = DURATION * FREQUENCY
    signed = either_sign(rng) * size
    if kind == "presliding":
        return ImitatingEffect(law={"presliding": size})
    if kind == "stiffness_drift":
        return ImitatingEffect(law={"stiffness_change": signed})
    if kind == "gain_drift":
        return ImitatingEffect(sensor={"gain_change": signed})
    if kind == "quadratic_stiffness":
        return ImitatingEffect(law={"quadratic_stiffness": signed})
    if kind == "sticking_turns":
        return ImitatingEffect(pause=size)
    if kind == "position_friction":
        return ImitatingEffect(law={str(rng.choice(("friction_tilt", "friction_rise"))): signed})
    if kind == "one_sided_stop":
        return ImitatingEffect(law={"stop_gap": rng.uniform(0.3, 0.8), "stop_stiffness": size})
    if kind == "second_mode":
        return ImitatingEffect(
            sensor={
                "mode_amplitude": size,
                "mode_frequency": rng.uniform(1.7, 6.0),
                "mode_decay": 1.0 / (rng.uniform(0.05, 0.3) * end),
                "mode_phase": rng.uniform(0.0, 2.0 * math.pi),
            }
        )
    if kind == "touch":
        middle, length = rng.uniform(0.3, 0.7) * end, 2.0 * math.pi * rng.uniform(0.3, 2.0)
        return ImitatingEffect(touch=(signed * DISSIPATION, middle, length))
    if kind == "slight_damping":
        return ImitatingEffect(law={"damping_ratio": size})
    if kind == "cancelling_pair":
        # per half cycle friction takes 2 d and damping pi zeta times the amplitude
        damping = math.pi * size
        fallen = end / math.pi * (2.0 * DISSIPATION + 0.75 * damping)
        rise = rng.uniform(0.5, 1.5) * damping * min(fallen, 1.0) / (2.0 * DISSIPATION)
        return ImitatingEffect(law={"damping_ratio": size, "relative_change": rise})
    raise ValueError(f"unknown kind {kind!r}, one of {', '.join(SIZES)}")


def sampled(effect: ImitatingEffect) -> Array:
    """Signal of the rig without noise, in initial amplitudes, shape (n,)."""
    times = np.arange(0.0, DURATION, 1.0 / SAMPLING_RATE) * FREQUENCY
    end = DURATION * FREQUENCY
    law = Law(friction=DISSIPATION, duration=end, **effect.law)
    if effect.touch is not None or law.presliding:
        grid = _STEP * np.arange(math.ceil(end / _STEP) + 1)
        force = np.zeros(grid.size) if effect.touch is None else _touch(grid, *effect.touch)
        x = integrate_disturbed(law, 1.0, 0.0, _STEP, force).sample(times)[0]
    else:
        motion = integrate(law, 1.0, 0.0, end)
        # a contact that sticks for a while at every turning point delays a motion that knows no time
        starts = motion.turning_times + effect.pause * np.arange(motion.turning_times.size)
        paused = np.clip(times[:, None] - starts, 0.0, effect.pause).sum(axis=1)
        x = motion.sample(times - paused)[0]
    return with_sensor(x, times, float(np.sqrt(np.mean(x**2))), AMPLITUDE, effect.sensor)


def _touch(times: Array, force: float, middle: float, length: float) -> Array:
    window = np.cos(math.pi * (times - middle) / length) ** 2
    return np.where(np.abs(times - middle) < 0.5 * length, force * window, 0.0)


def draw_near_threshold(kind: str, seed: np.random.SeedSequence | int) -> ThresholdRecord:
    """Draw one record of a kind of :data:`KINDS`; the seed decides everything."""
    rng = np.random.default_rng(seed)
    effect, size = ImitatingEffect(), 0.0
    if kind != PLAIN:
        seen, largest = SIZES[kind]
        size = log_uniform(rng, 0.01 * seen, largest)
        effect = draw_effect_of_size(kind, size, rng)
    clean = AMPLITUDE * sampled(effect)
    measured = clean + NOISE * rng.standard_normal(clean.size)
    time = np.arange(clean.size) / SAMPLING_RATE
    record = make_record(time, measured, "displacement", name="sealed record", synthetic=True)
    return ThresholdRecord(records=(record,), kind=kind, size=size)
