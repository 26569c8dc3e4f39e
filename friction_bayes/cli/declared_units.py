"""Mass and stiffness in other units than SI, by the frequency that they give and the one that is recorded."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from friction_bayes.core.errors import InputError
from friction_bayes.core.system import Oscillator
from friction_bayes.records.clock import sampling_interval
from friction_bayes.records.record import record_name

__all__ = ["check_declared_units"]

_LEAST_HALF_PERIODS = 3.0
"""Of the declared frequency; no friction is found in a shorter record, whatever moves in it."""
_POWERS = {False: (3,), True: (3, 4, 7)}
"""Powers of ten between units of mass or stiffness and SI; of rotors (True) g m2, kg cm2, g cm2. The sixth is
also that of a clock in ms or ks."""
_NEAR = 0.1
"""Relative error of a declared frequency."""


def check_declared_units(record: xr.DataArray, system: Oscillator) -> None:
    """Refuse a system that seems to be declared in other units than SI.

    It is where the record has fewer than three half periods of the declared frequency, and most of its motion
    is faster by the square root of a power of ten that lies between units.

    Parameters
    ----------
    record : xarray.DataArray
        A validated record.
    system : Oscillator
        The declared system.

    Raises
    ------
    InputError
        Naming both frequencies.
    """
    time, values = record["time"].values, record.values
    lasting = float(time[-1] - time[0])
    if lasting * system.natural_frequency > _LEAST_HALF_PERIODS * math.pi:
        return
    even = np.interp(np.linspace(time[0], time[-1], time.size), time, values)
    power = np.abs(np.fft.rfft((even - even.mean()) * np.hanning(even.size)))
    frequency = np.fft.rfftfreq(even.size, sampling_interval(record))[int(power.argmax())]
    declared = system.natural_frequency / (2.0 * math.pi)
    times = float(frequency) / declared
    if not any(abs(times / 10.0 ** (0.5 * n) - 1.0) < _NEAR for n in _POWERS[system.angular]):
        return
    units = "kg m2 and N m/rad" if system.angular else "kg and N/m"
    others = "g m2, kg cm2 or g cm2" if system.angular else "g or N/mm"
    raise InputError(
        record_name(record),
        f"the motion at {frequency:.3g} Hz is {times:.3g} times as fast as {system.moving_name} and "
        f"stiffness give, {declared:.3g} Hz: in {others}?",
        f"give {units}",
    )
