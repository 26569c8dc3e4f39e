"""Records that went through a low pass, of the acquisition or of the export, noise and all."""

from __future__ import annotations

from functools import partial

import numpy as np

from experiments.ordinary.coulomb_motion import CoulombMotion
from experiments.ordinary.processing import (
    Process,
    causal_low_pass,
    moving_mean,
    savitzky_golay,
    zero_phase_low_pass,
)
from experiments.ordinary.recording import Layout, draw_layout, recorded
from experiments.ordinary.rig import SENSORS, OrdinaryRecord, Recipe, Rig

__all__ = ["FILTERED"]

_CORNERS = (5.0, 10.0, 20.0)
"""Over the motion's frequency."""
_SNR_DB = (60.0, 45.0, 30.0)
_SAVITZKY_GOLAY_WINDOW = 21
_SAVITZKY_GOLAY_CORNER = 0.051
"""Corner of the cubic over 21 samples, in cycles a sample."""
_SAVITZKY_GOLAY_PER_PERIOD = (60.0, 120.0, 240.0)
"""Samples a period: corners at 3, 6 and 12 times the motion's frequency."""
_MOVING_MEAN_CORNER = 0.443
"""Corner of a moving mean times its length, in cycles."""
_LEAST_WINDOW = 3.0
_MARGIN_PERIODS = 2.0


def _filter(kind: str, corner: float, rate: float) -> Process:
    if kind == "causal":
        return causal_low_pass(corner, rate)
    if kind == "zero phase":
        return zero_phase_low_pass(corner, rate)
    if kind == "moving mean":
        half = round((_MOVING_MEAN_CORNER * rate / corner - 1.0) / 2.0)
        return moving_mean(2 * max(half, 1) + 1)
    return savitzky_golay(_SAVITZKY_GOLAY_WINDOW)


def _drawn(kind: str, rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """Sensors, corners and noises in turn; every other record was cut from a longer filtered one."""
    i = replicate
    # each sensor meets each corner in nine records, and each of these each noise in 27
    sensor, which, snr_db = SENSORS[i % 3], i // 3 % 3, _SNR_DB[(i + i // 3 + i // 9) % 3]
    corner, per_period = _CORNERS[which], (60.0, 500.0)
    if kind == "Savitzky-Golay":
        middle = _SAVITZKY_GOLAY_PER_PERIOD[which]
        corner, per_period = _SAVITZKY_GOLAY_CORNER * middle, (0.95 * middle, 1.05 * middle)
    if kind == "moving mean":
        per_period = (max(60.0, _LEAST_WINDOW / _MOVING_MEAN_CORNER * corner), 500.0)
    layout = draw_layout(rng, per_period=per_period)
    margin = round(_MARGIN_PERIODS * layout.per_period) if rng.random() < 0.5 else 0
    return recorded(
        rng,
        layout,
        CoulombMotion(layout.rig, layout.amplitude),
        sensor,
        snr_db=snr_db,
        process=_filter(kind, corner / layout.rig.period, 1.0 / layout.step),
        margin=margin,
        corner=corner,
    )


def _fixed(sensor: str, process: Process, rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """10 kg, 1000 N/m, 1 N, released at 0.05 m, 12 s at 100 Hz; the noise goes round."""
    rig = Rig(10.0, 1000.0, 1.0)
    layout = Layout(rig=rig, amplitude=0.05, begin=0.0, step=0.01, samples=1200)
    return recorded(
        rng, layout, CoulombMotion(rig, 0.05), sensor, snr_db=_SNR_DB[replicate % 3], process=process
    )


FILTERED: dict[str, Recipe] = {
    **{
        f"low pass: {kind}": partial(_drawn, kind)
        for kind in ("causal", "zero phase", "Savitzky-Golay", "moving mean")
    },
    "10 kg: acceleration, causal at 16 Hz": partial(_fixed, "acceleration", causal_low_pass(16.0, 100.0)),
    "10 kg: displacement, zero phase at 8 Hz": partial(
        _fixed, "displacement", zero_phase_low_pass(8.0, 100.0)
    ),
    "10 kg: displacement, zero phase at 16 Hz": partial(
        _fixed, "displacement", zero_phase_low_pass(16.0, 100.0)
    ),
    "10 kg: displacement, Savitzky-Golay 21": partial(
        _fixed, "displacement", savitzky_golay(_SAVITZKY_GOLAY_WINDOW)
    ),
}
"""By the row of the table."""
