"""Plain records with white noise: short clean ones, controls of any kind, and very few samples."""

from __future__ import annotations

from functools import partial

import numpy as np

from experiments.ordinary.coulomb_motion import CoulombMotion
from experiments.ordinary.recording import Layout, draw_layout, recorded
from experiments.ordinary.rig import SENSORS, OrdinaryRecord, Recipe, Rig

__all__ = ["CLEAN"]


def _one_accelerometer(rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """One fixed recipe: four and a half half cycles of acceleration at 40 dB; the noise alone is drawn."""
    rig = Rig(1.0, 400.0, 0.31111)
    layout = Layout(rig=rig, amplitude=0.01, begin=0.0, step=1.0 / 477.465, samples=round(0.70686 * 477.465))
    return recorded(rng, layout, CoulombMotion(rig, 0.01), "acceleration", noise_sd=0.012)


def _short(rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """Four to eight half cycles at 30 to 60 dB."""
    layout = draw_layout(rng, half_cycles=(4.0, 8.0), to_rest=(1.0, 4.0))
    return _white(rng, layout, SENSORS[replicate % 3], rng.uniform(30.0, 60.0))


def _few_samples(rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """20 to 63 samples in all, six or more a period."""
    samples = int(rng.integers(20, 64))
    layout = draw_layout(
        rng,
        half_cycles=(4.0, min(12.0, samples / 3.0)),
        per_period=(60.0, 60.0),
        to_rest=(1.0, 4.0),
    )
    length = layout.samples * layout.step
    coarse = Layout(
        rig=layout.rig,
        amplitude=layout.amplitude,
        begin=layout.begin,
        step=length / samples,
        samples=samples,
    )
    return _white(rng, coarse, SENSORS[replicate % 3], rng.uniform(20.0, 50.0))


def _control(sensor: str, rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """4 to 60 half cycles at 10 to 60 dB."""
    return _white(rng, draw_layout(rng), sensor, rng.uniform(10.0, 60.0))


def _white(rng: np.random.Generator, layout: Layout, sensor: str, snr_db: float) -> OrdinaryRecord:
    motion = CoulombMotion(layout.rig, layout.amplitude)
    return recorded(rng, layout, motion, sensor, snr_db=snr_db)


CLEAN: dict[str, Recipe] = {
    "short, one accelerometer": _one_accelerometer,
    "short and clean": _short,
    "few samples": _few_samples,
    **{f"control: white noise, {sensor}": partial(_control, sensor) for sensor in SENSORS},
}
"""By the row of the table."""
