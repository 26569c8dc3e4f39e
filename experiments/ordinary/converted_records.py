"""Records that were resampled, differentiated, integrated, AC coupled or saturated."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from experiments.ordinary.coulomb_motion import CoulombMotion
from experiments.ordinary.processing import ac_coupling, differentiated, integrated_twice, straight_lines
from experiments.ordinary.recording import draw_layout, noise_for, recorded
from experiments.ordinary.rig import SENSORS, OrdinaryRecord, Recipe

__all__ = ["CONVERTED"]

_EVERY = 10
_SETTLED_PERIODS = 20.0


def _straight_lines(rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """Every tenth sample kept, 12 to 50 of these a period."""
    layout = draw_layout(rng, per_period=(12.0 * _EVERY, 500.0))
    return recorded(
        rng,
        layout,
        CoulombMotion(layout.rig, layout.amplitude),
        SENSORS[replicate % 3],
        snr_db=rng.uniform(30.0, 60.0),
        process=straight_lines(_EVERY),
    )


def _differentiated(order: int, rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """A displacement sensor as people have them, 60 to 200 samples a period."""
    layout = draw_layout(rng, per_period=(60.0, 200.0))
    return recorded(
        rng,
        layout,
        CoulombMotion(layout.rig, layout.amplitude),
        "displacement",
        snr_db=rng.uniform(50.0, 70.0),
        process=differentiated(order, layout.step),
        order=order,
    )


def _integrated_twice(rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """Accelerations to displacements."""
    layout = draw_layout(rng)
    return recorded(
        rng,
        layout,
        CoulombMotion(layout.rig, layout.amplitude),
        "acceleration",
        snr_db=rng.uniform(40.0, 60.0),
        process=integrated_twice(layout.step),
        order=-2,
    )


def _ac_coupled(rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """Corner at 0.02 to 0.3 of the motion's frequency; every other record's coupling had settled before."""
    layout = draw_layout(rng)
    share = float(np.exp(rng.uniform(np.log(0.02), np.log(0.3))))
    settled = round(_SETTLED_PERIODS * layout.per_period) if rng.random() < 0.5 else 0
    return recorded(
        rng,
        layout,
        CoulombMotion(layout.rig, layout.amplitude),
        SENSORS[replicate % 3],
        snr_db=rng.uniform(30.0, 60.0),
        process=ac_coupling(share / layout.rig.period, 1.0 / layout.step),
        margin=settled,
        corner=share,
    )


def _saturated(rng: np.random.Generator, replicate: int) -> OrdinaryRecord:
    """The sensor ends at 60 to 98 % of its largest signal; the recorder's noise comes on top of that."""
    layout = draw_layout(rng)
    share, snr_db = rng.uniform(0.6, 0.98), rng.uniform(30.0, 60.0)

    def saturate(values: NDArray[np.float64]) -> NDArray[np.float64]:
        level = share * float(np.max(np.abs(values)))
        shown = np.clip(values, -level, level)
        return shown + noise_for(values, snr_db) * rng.standard_normal(values.size)

    return recorded(
        rng,
        layout,
        CoulombMotion(layout.rig, layout.amplitude),
        SENSORS[replicate % 3],
        noise_sd=0.0,
        after=saturate,
        level=share,
    )


CONVERTED: dict[str, Recipe] = {
    "straight lines between every tenth sample": _straight_lines,
    "displacement differentiated once": partial(_differentiated, 1),
    "displacement differentiated twice": partial(_differentiated, 2),
    "acceleration integrated twice": _integrated_twice,
    "AC coupled": _ac_coupled,
    "saturated": _saturated,
}
"""By the row of the table."""
