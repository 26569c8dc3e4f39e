"""A recording of several free decays, cut into one record each."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import xarray as xr

from friction_bayes.core.system import Oscillator, check_system
from friction_bayes.decay.dropouts import without_dropouts
from friction_bayes.decay.excursions import without_excursions
from friction_bayes.decay.free_decay import check_sampling
from friction_bayes.decay.location import decays_within
from friction_bayes.records.clock import gaps, sampling_interval
from friction_bayes.records.record import MINIMUM_SAMPLES, record_name, record_quantity, validate_record
from friction_bayes.records.starting_over import while_going_on

__all__ = ["split_decays"]


def split_decays(record: xr.DataArray, system: Oscillator) -> list[xr.DataArray]:
    """Cut a recording into its free decays.

    A decay begins where the amplitude rises at once, see :mod:`friction_bayes.decay.releases`, or where the
    recording goes on after a pause, and holds three half cycles or more that no hand moves; rest or hold
    before the release stays with it.

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
        where it neither holds several nor pauses.

    Raises
    ------
    InputError
        If the record is unusable, or sampled too slowly for the declared frequency.
    """
    check_system(system)
    validate_record(record)
    record = while_going_on(record)
    name, time = record_name(record), record["time"].values
    check_sampling(name, sampling_interval(record), system)
    pauses = gaps(time, system.natural_frequency) + 1
    ends = [0, *pauses.tolist(), time.size]
    stretches = [record[first:last] for first, last in pairwise(ends) if last - first >= MINIMUM_SAMPLES]
    decays = [stretch[part] for stretch in stretches for part in _parts(stretch, system)]
    if len(decays) < 2 and not pauses.size:
        return [record]
    return [each.assign_attrs(name=f"{name} decay {k}") for k, each in enumerate(decays, start=1)]


def _parts(record: xr.DataArray, system: Oscillator) -> list[slice]:
    """Parts of a recording without pauses that hold a free decay each."""
    step = sampling_interval(record)
    angle = system.natural_frequency * step
    values, _ = without_dropouts(np.asarray(record.values, dtype=np.float64), angle)
    values, _ = without_excursions(values, angle)
    order = record_quantity(record).order
    return [each.part for each in decays_within(values, step, system.natural_frequency, order)]
