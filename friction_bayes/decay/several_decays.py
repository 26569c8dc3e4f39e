"""A recording of several free decays, cut into one record each."""

from __future__ import annotations

import numpy as np
import xarray as xr

from friction_bayes.core.system import Oscillator
from friction_bayes.decay.excursions import without_excursions
from friction_bayes.decay.free_decay import check_sampling
from friction_bayes.decay.location import decays_within
from friction_bayes.records.clock import sampling_interval
from friction_bayes.records.record import record_name, record_quantity, validate_record

__all__ = ["split_decays"]


def split_decays(record: xr.DataArray, system: Oscillator) -> list[xr.DataArray]:
    """Cut a recording into its free decays.

    A decay begins where the amplitude rises at once, see :mod:`friction_bayes.decay.releases`, and holds
    three half cycles or more that no hand moves; rest or hold before the release stays with it.

    Parameters
    ----------
    record : xarray.DataArray
        A record, from :func:`friction_bayes.read_record` or :func:`friction_bayes.make_record`.
    system : Oscillator
        The declared system, whose frequency says where to look.

    Returns
    -------
    list of xarray.DataArray
        One a decay, in order, on the clock of the recording; their names end in its number. The record itself
        where it does not hold several.

    Raises
    ------
    InputError
        If the record is unusable, or sampled too slowly for the declared frequency.
    """
    validate_record(record)
    step = sampling_interval(record)
    check_sampling(record_name(record), step, system)
    values, _ = without_excursions(
        np.asarray(record.values, dtype=np.float64), system.natural_frequency * step
    )
    decays = decays_within(values, step, system.natural_frequency, record_quantity(record).order)
    if len(decays) < 2:
        return [record]
    return [
        record[each.part].assign_attrs(name=f"{record_name(record)} decay {k}")
        for k, each in enumerate(decays, start=1)
    ]
