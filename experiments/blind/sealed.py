"""A record with a sealed truth: what the loop is given, and what it must find out, in two objects."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.blind.disturbed_motion import DisturbedMotion
from experiments.blind.laws import Motion

__all__ = ["SealedRecord", "Truth"]


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What the loop must find out.

    Attributes
    ----------
    kind : str
        One of :data:`experiments.blind.generator.KINDS`, or of the contact and sensor.
    effects : tuple of str
        Effects at work, whether or not they leave a trace.
    visible : tuple of str
        Effects that leave a trace in the measured quantity
        (see :func:`experiments.blind.generator.trace_of`).
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
    natural_frequency : float
        [rad/s].
    truth : Truth
        The seal.
    times, clean : ndarray, shape (n,)
        Dimensionless times, and the signal without noise and outliers but with the other sensor faults,
        in ``A`` or ``A w0**2``.
    noise_sd : float
        In the same unit as ``clean``.
    motion, start : Motion or DisturbedMotion, tuple of float
        Dimensionless, with its law; initial displacement and velocity.
    frequency : float
        Mean frequency of the motion over the natural one.
    rest_time : float
        Dimensionless; infinite where the record ends before rest.
    """

    record: xr.DataArray
    system: dict[str, float]
    natural_frequency: float
    truth: Truth
    times: NDArray[np.float64]
    clean: NDArray[np.float64]
    noise_sd: float
    motion: Motion | DisturbedMotion
    start: tuple[float, float]
    frequency: float
    rest_time: float
