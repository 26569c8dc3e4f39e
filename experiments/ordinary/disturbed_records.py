"""Records of a motion that something else acts on: a hand that lets go slowly, a drive that is cut."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from experiments.ordinary.forced_motion import ForcedMotion
from experiments.ordinary.loads import hand, steady_friction
from experiments.ordinary.recording import Layout, draw_layout, log_uniform, noise_for, recorded
from experiments.ordinary.rig import SENSORS, OrdinaryRecord, Recipe

__all__ = ["DISTURBED"]

_STEPS_A_PERIOD = 200.0
_LEAST_FREE = 6
"""Half cycles of free decay that have to be left."""
_DRAWS = 200


def _hand_at_the_start(
    half_cycles: tuple[float, float],
    per_period: tuple[float, float],
    rng: np.random.Generator,
    replicate: int,
) -> OrdinaryRecord:
    """A hand of 3 to 30 frictions that fades out within 0.3 to 1.5 periods, pulling or pushing."""
    for _ in range(_DRAWS):
        layout = draw_layout(rng, half_cycles=half_cycles, per_period=per_period, from_release=True)
        size = log_uniform(rng, 3.0, 30.0) * float(rng.choice([-1.0, 1.0]))
        until = rng.uniform(0.3, 1.5) * layout.rig.period
        step = layout.rig.period / _STEPS_A_PERIOD
        force = hand(size * layout.rig.friction, until, step, math.ceil(layout.end / step) + 2)
        motion = _moved(layout, force, step, layout.amplitude)
        if np.count_nonzero(motion.turning_times > until) >= _LEAST_FREE:
            return recorded(
                rng,
                layout,
                motion,
                SENSORS[replicate % 3],
                snr_db=rng.uniform(30.0, 60.0),
                size=size * math.copysign(1.0, layout.amplitude),
                until=until / layout.rig.period,
            )
    raise RuntimeError(f"no hand in {_DRAWS} left {_LEAST_FREE} half cycles of free decay")


def _moved(layout: Layout, force: NDArray[np.float64], step: float, start: float) -> ForcedMotion:
    return ForcedMotion(layout.rig, steady_friction(layout.rig.friction), force, step, start)


def _driven_then_free(rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """From rest, 4 to 15 frictions for 4 to 15 periods near resonance, then 8 to 40 half cycles of decay."""
    for _ in range(_DRAWS):
        layout = draw_layout(rng, per_period=(60.0, 200.0), half_cycles=(8.0, 40.0), from_release=True)
        driven = rng.uniform(4.0, 15.0) * layout.rig.period
        size = log_uniform(rng, 4.0, 15.0) * layout.rig.friction
        frequency = layout.rig.frequency * rng.uniform(0.95, 1.05)
        step = layout.rig.period / _STEPS_A_PERIOD
        times = step * np.arange(math.ceil((layout.end + driven) / step) + 2)
        force = np.where(times < driven, size * np.sin(frequency * times), 0.0)
        motion = _moved(layout, force, step, 0.0)
        if np.count_nonzero(motion.turning_times > driven) >= _LEAST_FREE:
            whole = Layout(
                rig=layout.rig,
                amplitude=0.0,
                begin=0.0,
                step=layout.step,
                samples=layout.samples + round(driven / layout.step),
            )
            return recorded(
                rng,
                whole,
                motion,
                SENSORS[replicate % 3],
                snr_db=rng.uniform(30.0, 60.0),
                until=driven / layout.rig.period,
            )
    raise RuntimeError(f"no drive in {_DRAWS} left {_LEAST_FREE} half cycles of free decay")


def _steady_drive(rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """Oscillation at the natural frequency that grows to 0.01 m within 10 s and stays: nothing decays."""
    mass, w = log_uniform(rng, 0.05, 50.0), 2.0 * math.pi * log_uniform(rng, 0.5, 3.0)
    rise, size = 10.0, 0.01
    step = 2.0 * math.pi / w / log_uniform(rng, 60.0, 120.0)
    times = step * np.arange(round(rng.uniform(25.0, 60.0) / step), dtype=np.float64)
    growing = times < rise
    grown = np.where(growing, times / rise, 1.0)
    rate = np.where(growing, 1.0 / rise, 0.0)
    sine, cosine = np.sin(w * times), np.cos(w * times)
    sensor = SENSORS[replicate % 3]
    clean = {
        "displacement": size * grown * sine,
        "velocity": size * (rate * sine + grown * w * cosine),
        "acceleration": size * (2.0 * rate * w * cosine - grown * w**2 * sine),
    }[sensor]
    values = clean + noise_for(clean, rng.uniform(20.0, 60.0)) * rng.standard_normal(times.size)
    return OrdinaryRecord(
        times=times, values=values, quantity=sensor, mass=mass, stiffness=mass * w**2, truth=None
    )


DISTURBED: dict[str, Recipe] = {
    "hand at the start": partial(_hand_at_the_start, (8.0, 60.0), (60.0, 500.0)),
    "hand at the start, 200 half cycles": partial(_hand_at_the_start, (200.0, 200.0), (60.0, 120.0)),
    "driven, then free": _driven_then_free,
    "steady drive alone": _steady_drive,
}
"""By the row of the table."""
