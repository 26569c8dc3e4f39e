"""Friction from many records at once: arrays in, an ``xarray.Dataset`` out."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

from friction_bayes.conjugate.scaled_distribution import scaled, scaled_moments, scaled_quantiles
from friction_bayes.core.arrays import Array, Indices, Integers, Mask
from friction_bayes.core.blas import single_threaded_blas
from friction_bayes.core.declared_force import ForceFactor, declared_forces, frequencies_disagree
from friction_bayes.core.errors import InputError, RecordWarning
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, Quantity
from friction_bayes.core.summary import TAILS
from friction_bayes.core.system import Oscillator, check_system
from friction_bayes.decay.dropouts import without_dropouts
from friction_bayes.decay.excursions import excursions_possible, without_excursions
from friction_bayes.decay.free_decay import FreeDecay, after_leap, check_sampling
from friction_bayes.decay.friction_samples import PEAKS
from friction_bayes.decay.leaps import find_leap, leaps_possible
from friction_bayes.decay.located import FOUND, NOT_DECAYING, Located
from friction_bayes.decay.location import locate_free_decays
from friction_bayes.decay.pendulum_likeness import pendulum_notes
from friction_bayes.decay.sensor_calibration import (
    force_factor,
    force_factors,
    friction_unit,
    length_unit,
    swing_frequency,
)
from friction_bayes.decay.spans import Extremes, extremes
from friction_bayes.estimators.base import SURELY_NEGATIVE, Estimator, Fit, Fits, FreeDecays
from friction_bayes.estimators.envelope.loss_of_amplitude import UnevenLoss, uneven_loss
from friction_bayes.estimators.equally_probable import EquallyProbable, equally_probable
from friction_bayes.estimators.estimate import check_choices
from friction_bayes.estimators.noise.coulomb_regression import LEAST_SAMPLES
from friction_bayes.estimators.noise.noise_level import looks_white
from friction_bayes.estimators.noise.stray_samples import stray_samples
from friction_bayes.estimators.priors import complete_prior
from friction_bayes.estimators.registry import estimator_named
from friction_bayes.estimators.result import far_apart, rather_a_push
from friction_bayes.estimators.stack import TIME_LAST, as_stack
from friction_bayes.estimators.waveform.averaged import averaged_over_accounts
from friction_bayes.estimators.waveform.estimator import WaveformEstimator
from friction_bayes.estimators.waveform.free_part import free_part
from friction_bayes.estimators.waveform.saturation import saturation_level
from friction_bayes.estimators.witness import answer_parts, not_negative
from friction_bayes.records.clipping import clipped_fraction
from friction_bayes.records.held_readings import held_readings
from friction_bayes.records.joined_readings import joined_readings
from friction_bayes.records.record import MINIMUM_SAMPLES
from friction_bayes.records.starting_over import going_on

__all__ = ["STATUS", "WARNINGS", "estimate_batch"]

STATUS = (
    "ok",
    "not_finite",
    "constant",
    "no_oscillation",
    "too_short",
    "not_decaying",
    "several_modes",
    "several_decays",
    "no_fit",
    "clipped",
    "leaps",
)
"""Meaning of ``status`` 0, 1, 2, ..."""

WARNINGS = {
    "samples_set_aside": "samples leap out of the motion and are set aside",
    "later_start": "a first part that does not fit the rest is left out",
    "earlier_end": "a last part that does not fit the rest is left out",
    "disturbed_release": "half cycles of a disturbed release are left out",
    "driven_before": "a first part that loses no amplitude is left out",
    "uneven_loss": "the amplitude falls faster or slower while it is larger",
    "frequency": "the frequency is far from the declared one",
    "pendulum": "the swings look like a pendulum's",
    "negative_friction": "friction is negative",
    "push": "a force would have to act many times as large as friction",
    "held_readings": "readings are held, or joined by straight lines: estimate takes them alone",
    "taken_out": "interference, another mode or a drift of the sensor's zero is taken out",
    "numbers_start_over": "numbers start over, as at the end of a turn, and are taken to go on there",
}
"""Bits of ``warnings``, the lowest first, and what they say of a record."""
_BIT = {name: 1 << i for i, name in enumerate(WARNINGS)}
_OF_DECAYS = (
    "later_start",
    "earlier_end",
    "uneven_loss",
    "pendulum",
    "samples_set_aside",
    "held_readings",
    "taken_out",
)
"""Those that show in the decay that was used."""

_COEFFICIENTS = 5
"""Fitted to each record."""
_OK, _NO_FIT, _CLIPPED, _LEAPS = (STATUS.index(word) for word in ("ok", "no_fit", "clipped", "leaps"))
_SHARE_IN_PLACE, _SHARE_COPIED = 1.0 / 4.0, 1.0 / 16.0
"""Of the memory of the records, whose samples are worked on at a time: as they are, or copied to floats."""
_LEAST_PART, _LARGEST_PART = 2_000_000, 16_000_000
"""So many of them."""
_COLUMNS_SEEN = 100
"""Of an array that may be turned, about."""

_COLUMNS = (
    "friction_mean",
    "friction_sd",
    "friction_low",
    "friction_high",
    "friction_over_stiffness_mean",
    "friction_over_stiffness_sd",
    "friction_over_stiffness_low",
    "friction_over_stiffness_high",
    "noise_sd",
    "frequency",
    "frequency_sd",
    "rest_position",
    "status",
)
_STATUS = _COLUMNS.index("status")
_FORCE_COLUMNS = ("random_force_probability", "random_force_sd")


def estimate_batch(
    records: Any,
    system: Oscillator,
    *,
    sampling_rate: float | None = None,
    method: str = "waveform",
    quantity: str = "displacement",
    prior: Mapping[str, float] | None = None,
    peaks: str = "highest",
    random_force: str = "auto",
    judge: bool = True,
) -> xr.Dataset:
    """Estimate friction from many free decays of one system, in closed form.

    The numbers are those of :func:`friction_bayes.estimate` with ``random_force="none"``, record by record,
    up to rounding. With ``random_force="auto"`` method ``waveform`` averages those records whose residuals
    are not white noise over a force that fluctuates, as :func:`friction_bayes.estimate` does with all. In the
    others losses that are not by dry friction count by the probability that the amplitudes give them.
    Readings that a logger held (:mod:`friction_bayes.records.held_readings`) are fitted as they are: all
    records have one clock here. Estimate such a record by itself.

    Parameters
    ----------
    records : array_like, dask array, xarray.DataArray, pandas.DataFrame or sequence of records
        An array has shape (records, samples) and SI units; what a masked array masks is missing. A DataArray
        has a dimension ``time`` and one other, or more (machine, point), in any order; its ``time``
        coordinate gives the sampling rate, its attributes ``quantity`` and ``units``. A DataFrame has one
        column a record, and its index gives the times. Records of a sequence have one quantity and one
        clock. A Dask array stays lazy: so does the result.
    system : Oscillator
        Mass or inertia, and stiffness.
    sampling_rate : float, optional
        Samples a second, where ``records`` does not say.
    method : str
        ``waveform``, ``envelope``, ``normal-gamma`` or ``gamma-exponential``, or one registered from outside.
    quantity : str
        What was measured, where ``records`` does not say.
    prior : mapping, optional
        Prior parameters by key, as in :func:`friction_bayes.estimate`.
    peaks : {"highest", "nominal"}
        How the paper's two methods pick amplitudes.
    random_force : {"auto", "none"}
        Whether a force that fluctuates may be there; method ``waveform`` alone knows one.
    judge : bool
        Whether to judge each record as :func:`friction_bayes.estimate` does: ``warnings`` then has what it
        warns of and leaves out at the start and the end, and tops that are flat below noise are ``clipped``
        without a random force too. This takes longer than the numbers of a record of white noise.

    Returns
    -------
    xarray.Dataset
        Over ``record``, or the dimensions of the records where they are several (and ``bound`` for
        intervals): ``friction_mean``, ``friction_sd``, ``friction_interval90``, the same of
        ``friction_over_stiffness``, ``noise_sd``, ``frequency`` and
        ``frequency_sd`` [rad/s], ``rest_position`` and ``status``; where a random force is looked for also
        ``random_force_probability`` and ``random_force_sd``, given that there is one, both nan in records
        whose residuals are white. A record that cannot be used has a status
        other than 0, see its attribute ``flag_meanings``, and nan elsewhere. Where records are judged,
        ``warnings`` has a bit for each of ``WARNINGS``, see ``flag_masks`` and ``flag_meanings``.

    Raises
    ------
    InputError
        If the array is not two-dimensional, its sampling rate is missing, records lie along its second axis,
        or an argument is wrong. Of a Dask array the axes show when it is computed.

    Warns
    -----
    RecordWarning
        Once, with the number of records of each of the ``warnings``; not of a Dask array, which stays lazy.
    """
    check_system(system)
    estimator = estimator_named(method)
    check_choices(peaks, random_force)
    with_force = random_force == "auto" and method == WaveformEstimator.name
    columns = (*_COLUMNS, *_FORCE_COLUMNS * with_force, *("warnings",) * judge)
    stack, kind, unit, step = as_stack(records, sampling_rate, quantity)
    if kind.angular != system.angular:
        expected = "inertia" if kind.angular else "mass"
        raise InputError(
            "quantity", f"{kind.name} of the other kind of system", f"declare the system by {expected}"
        )
    check_sampling("sampling_rate", step, system)
    empty = np.empty((0, stack.sizes["time"]))
    none = FreeDecays(
        values=empty,
        located=locate_free_decays(empty, step, system.natural_frequency, kind.order),
        step=step,
        system=system,
        quantity=kind,
        unit=unit,
    )
    chosen = complete_prior(estimator.name, estimator.default_prior(none), prior)
    # what is refused of every record is refused now, and not when a Dask array is computed
    estimator.fit_many(none, chosen, peaks=peaks)
    table = xr.apply_ufunc(
        _estimate_block,
        stack,
        kwargs={
            "estimator": estimator,
            "like": none,
            "prior": chosen,
            "peaks": peaks,
            "with_force": with_force,
            "judge": judge,
            "may_be_turned": "time" not in stack.coords,
        },
        input_core_dims=[["time"]],
        output_core_dims=[["column"]],
        dask="parallelized",
        dask_gufunc_kwargs={"output_sizes": {"column": len(columns)}},
        output_dtypes=[np.float64],
    )
    result = _as_dataset(table, columns, system, kind, unit).assign_attrs(method=method, peaks=peaks)
    if table.chunks is None:
        said = _counted(result["warnings"].values) if judge else ""
        if said:
            warnings.warn(said, RecordWarning, stacklevel=2)
    return result


def _counted(found: Integers) -> str:
    """Say how many records have each of the warnings; empty where none has any."""
    counts = [(np.count_nonzero(found & _BIT[name]), said) for name, said in WARNINGS.items()]
    listed = "; ".join(f"{said}: {count}" for count, said in counts if count)
    if not listed:
        return ""
    return (
        f"{np.count_nonzero(found)} of {found.size} records have warnings ({listed}): `warnings` of the "
        "result says which, and estimate says more of each"
    )


def _estimate_block(values: NDArray[Any], **options: Any) -> Array:
    """Estimate every record of an array, shape (..., n) to (..., columns)."""
    table = _estimate_rows(values.reshape(-1, values.shape[-1]), **options)
    return table.reshape(*values.shape[:-1], table.shape[-1])


@single_threaded_blas()
def _estimate_rows(
    values: NDArray[Any],
    *,
    estimator: Estimator,
    like: FreeDecays,
    prior: Mapping[str, float],
    peaks: str,
    with_force: bool,
    judge: bool,
    may_be_turned: bool,
) -> Array:
    """Estimate every row of an array, shape (records, n) to (records, columns)."""
    in_place = values.dtype == np.float64 and values.flags.c_contiguous
    share = _SHARE_IN_PLACE if in_place else _SHARE_COPIED
    most = min(max(int(share * values.nbytes / 8), _LEAST_PART), _LARGEST_PART)
    rows = max(most // max(values.shape[1], 1), 1)
    parts = [
        # writeable as those of a single record are: kernels are compiled for one kind of array
        _estimate_chunk(
            np.require(part, np.float64, ["C", "W"]), estimator, like, prior, peaks, with_force, judge
        )
        for part in np.split(values, range(rows, len(values), rows))
    ]
    table = np.concatenate(parts)
    if may_be_turned:
        _refuse_turned(values, table[:, _STATUS] == _OK, like)
    return table


def _refuse_turned(values: Array, decays: Mask, like: FreeDecays) -> None:
    """Refuse an array more of whose columns than of its rows hold a decay, ``decays`` those of the rows.

    Looked at where most rows hold none, in some of the columns; not of records with times of their own, which
    say which axis is theirs.
    """
    if len(values) < MINIMUM_SAMPLES or decays.mean() >= 0.5:
        return
    some = slice(None, None, max(values.shape[1] // _COLUMNS_SEEN, 1))
    columns = np.require(values[:, some].T, np.float64, ["C", "W"])
    along = locate_free_decays(columns, like.step, like.system.natural_frequency, like.quantity.order)
    share = float(np.mean(along.status == FOUND))
    if share > decays.mean():
        raise InputError(
            "records",
            f"shape {values.shape}: {100.0 * decays.mean():.0f} % of the rows hold a decay, and "
            f"{100.0 * share:.0f} % of the columns",
            TIME_LAST,
        )


def _estimate_chunk(
    values: Array,
    estimator: Estimator,
    like: FreeDecays,
    prior: Mapping[str, float],
    peaks: str,
    with_force: bool,
    judge: bool,
) -> Array:
    """Estimate rows of the system and sensor that ``like`` declares."""
    system, kind = like.system, like.quantity
    seen = extremes(values)
    values, started_over = _going_on(values, like.unit, seen)
    seen = extremes(values) if started_over.any() else seen
    values, mended, dropouts = _set_aside(values, system.natural_frequency * like.step, seen)
    doubtful = seen.flat | mended
    seen = extremes(values) if mended.any() else seen
    located = locate_free_decays(values, like.step, system.natural_frequency, kind.order, seen=seen)
    for row in np.flatnonzero((located.status == FOUND) & doubtful).tolist():
        if clipped_fraction(values[row])[1] is not None:
            located.status[row] = _CLIPPED
    if kind.order == 0:
        _set_leaps_apart(values, located, seen.gap)
    decays = replace(like, values=values, located=located, dropouts=dropouts)
    fits = estimator.fit_many(decays, prior, peaks=peaks)
    found, family = fits.found, fits.family
    status = np.where((located.status == FOUND) & ~found, _NO_FIT, located.status)
    coefficient = tuple(np.where(found, parameter, np.nan) for parameter in fits.parameters)
    location, spread = (_finite(moment(*coefficient)) for moment in (family.mean, family.std))
    of_coefficient = np.array([location, spread, *(family.ppf(q, *coefficient) for q in TAILS)])
    friction = _friction(family, coefficient, of_coefficient, like, fits.frequency, fits.frequency_sd)
    columns = (*friction, *(of_coefficient * fits.frequency**-kind.order))
    rest = (fits.noise_sd, fits.frequency, fits.frequency_sd, fits.rest_position)
    table = np.column_stack([*columns, *(np.where(found, each, np.nan) for each in rest), status])
    flags = np.where(mended, _BIT["samples_set_aside"], 0)
    flags[started_over] |= _BIT["numbers_start_over"]
    flags[_finite(family.cdf(0.0, *coefficient)) > SURELY_NEGATIVE] |= _BIT["negative_friction"]
    used, looked_at = found.copy(), dict[int, tuple[FreeDecay, bool]]()
    white, straight = np.zeros((2, len(values)), dtype=np.bool_)
    if judge or with_force:
        seen_through = fits if fits.glance is not None else _whole_signals(decays)
        if seen_through is not None and seen_through.glance is not None:
            white, straight = seen_through.glance()
            if fits.glance is None:
                # amplitudes of a motion that has ended are judged as the method sees them
                straight &= ~located.stops
            _look_longer(white, used, decays, seen_through)
            white[list(dropouts)] = False
        _refuse_saturated(table, used, decays, white)
    if with_force:
        fit_of = partial(estimator.fit, prior=prior, peaks=PEAKS[0])
        table, looked_at = _answered(table, used, decays, flags, white, straight, fits, fit_of)
    if not judge:
        return table
    return np.column_stack([table, _judged(table, used, decays, looked_at, flags, white & straight)])


def _refuse(table: Array, row: int, status: int) -> None:
    """Leave nothing of a record but why."""
    table[row] = np.nan
    table[row, _STATUS] = status


def _whole_signals(decays: FreeDecays) -> Fits | None:
    """Fit the whole signals, of which a method that uses amplitudes alone leaves no residual to be judged.

    None of a pendulum, whose large swings are not fitted in a batch.
    """
    if swing_frequency(decays.system, decays.unit) > 0.0:
        return None
    waveform = WaveformEstimator()
    return waveform.fit_many(decays, waveform.default_prior(decays), peaks=PEAKS[0])


def _look_longer(white: Mask, used: Mask, decays: FreeDecays, fits: Fits) -> None:
    """Mark those residuals that a longer look finds white, without any stray sample.

    None of a method that leaves no residual.
    """
    if fits.residual is None:
        return
    for row in np.flatnonzero(used & fits.found & ~white & (decays.counts >= LEAST_SAMPLES)).tolist():
        decay, residual = decays.without_dropouts(row), fits.residual(row)
        if not stray_samples(residual, float(np.ptp(decay.values))).any():
            phase = fits.frequency[row] * decay.time
            white[row] = looks_white(residual, phase, decays.quantity.order, _COEFFICIENTS)


def _refuse_saturated(table: Array, used: Mask, decays: FreeDecays, white: Mask) -> None:
    """Refuse records whose tops are flat below noise, and take them out of those used.

    Flat tops leave no white noise.
    """
    for row in np.flatnonzero(used & ~white).tolist():
        if saturation_level(decays.decay(row)) is not None:
            _refuse(table, row, _CLIPPED)
            used[row] = False


def _judged(
    table: Array,
    used: Mask,
    decays: FreeDecays,
    looked_at: Mapping[int, tuple[FreeDecay, bool]],
    flags: Integers,
    straight: Mask,
) -> Integers:
    """Bits of the warnings of each record, shape (records,): those found, and those of the decays used.

    Whether the loss of amplitude is uneven is known of those ``looked_at``, by row with the decay that was
    used, and is not evaluated for those that are ``straight``.
    """
    system, located = decays.system, decays.located
    frequency, frequency_sd = (table[:, _COLUMNS.index(name)] for name in ("frequency", "frequency_sd"))
    found = {
        "disturbed_release": located.disturbed > 0,
        "driven_before": located.driven,
        "frequency": far_apart(system, frequency, frequency_sd),
        **{name: np.zeros_like(used) for name in _OF_DECAYS},
    }
    for row in np.flatnonzero(used).tolist():
        decay, uneven = looked_at.get(row, (None, False))
        if decay is None and (system.angular or not straight[row]):
            decay = decays.decay(row)
            uneven = not straight[row] and _sure(uneven_loss(decay))
        if decay is not None:
            found["later_start"][row] = decay.later > 0
            found["earlier_end"][row] = decay.earlier > 0
            found["samples_set_aside"][row] = bool(decay.stray)
            found["uneven_loss"][row] = uneven
            found["pendulum"][row] = bool(pendulum_notes(decay))
            repeats = _holds_readings(decays.values[row])
            found["held_readings"][row] = repeats
            # what repeats leave may pass for a drift
            found["taken_out"][row] = not repeats and (bool(decay.lines) or decay.drift > 0.0)
    judged = flags.copy()
    for name, applies in found.items():
        judged[applies] |= _BIT[name]
    return np.where(used, judged, 0)


def _holds_readings(values: Array) -> bool:
    """Whether some readings are held, or joined by straight lines."""
    return bool(held_readings(values).any() or joined_readings(values).any())


def _sure(uneven: UnevenLoss | None) -> bool:
    return uneven is not None and uneven.sure


def _set_leaps_apart(values: Array, located: Located, gap: Array) -> None:
    """Begin decays behind a leap from a rest, and mark those that leap in mid-motion."""
    start, stop, frequency = located.start, located.stop, located.frequency
    possible = leaps_possible(values, start, stop, frequency, gap, located.status == FOUND)
    for row in np.flatnonzero(possible).tolist():
        begin, end, omega = int(start[row]), int(stop[row]), float(frequency[row])
        released = after_leap(values[row, :end], begin, omega)
        located.start[row] = released
        located.phase[row] = (located.phase[row] + omega * (released - begin)) % (2.0 * math.pi)
        if find_leap(values[row, released:end]) is not None:
            located.status[row] = _LEAPS


def _going_on(values: Array, unit: str, seen: Extremes) -> tuple[Array, Mask]:
    """Rows in which numbers that start over go on, and which those are."""
    which = np.zeros(len(values), dtype=np.bool_)
    found = values
    # over half of what they may go, and no farther
    may_be = seen.finite & (seen.widest > 0.5 * (seen.high - seen.low))
    for row in np.flatnonzero(may_be).tolist():
        own = going_on(values[row], unit)
        if own is not None:
            found = values.copy() if found is values else found
            found[row], which[row] = own, True
    return found, which


def _set_aside(values: Array, angle: float, seen: Extremes) -> tuple[Array, Mask, dict[int, Indices]]:
    """Rows without dropouts and excursions, which those were in, and the dropouts' samples by row."""
    repeating = np.flatnonzero(seen.finite & seen.repeats).tolist()
    values, dropouts = _mended(values, repeating, partial(without_dropouts, angle=angle))
    possible = np.flatnonzero(excursions_possible(extremes(values) if dropouts else seen)).tolist()
    values, excursions = _mended(values, possible, partial(without_excursions, angle=angle))
    mended = np.zeros(len(values), dtype=np.bool_)
    mended[[*dropouts, *excursions]] = True
    return values, mended, dropouts


def _mended(
    values: Array, rows: Sequence[int], mend: Callable[[Array], tuple[Array, Indices]]
) -> tuple[Array, dict[int, Indices]]:
    """Rows some of which may have samples replaced, and which samples those are, by row."""
    found, replaced = values, {}
    for row in rows:
        own, samples = mend(values[row])
        if samples.size:
            found = values.copy() if found is values else found
            found[row], replaced[row] = own, samples
    return found, replaced


def _friction(
    family: Any,
    coefficient: tuple[Array, ...],
    of_coefficient: Array,
    like: FreeDecays,
    frequency: Array,
    frequency_sd: Array,
) -> Array:
    """Mean, sd and 90 % interval of friction from those ``of_coefficient``, shape (4, records)."""
    system, kind = like.system, like.quantity
    if like.unit in UNCALIBRATED_UNITS:
        return of_coefficient
    table = np.full((4, frequency.size), np.nan)
    disagree = frequencies_disagree(system, frequency, frequency_sd)
    for rows, both in ((~disagree, False), (disagree, True)):
        if rows.any():
            factors = declared_forces(system, kind, frequency[rows], disagree=both)
            own = tuple(each[rows] for each in coefficient)
            table[:, rows] = _in_force(family, own, of_coefficient[:, rows], factors)
    return table


def _in_force(
    family: Any, coefficient: tuple[Array, ...], of_coefficient: Array, factors: tuple[ForceFactor, ...]
) -> Array:
    """Mean, sd and interval of variables times one of some equally probable factors, shape (4, m).

    Those of the variables are ``of_coefficient``.
    """
    if len(factors) == 1 and factors[0].relative_sd == 0.0:
        return of_coefficient * factors[0].factor
    *shapes, location, scale = coefficient
    scaled_by = [((*shapes, location * factor, scale * factor), sd) for factor, sd in factors]
    moments = [scaled_moments(family.mean(*own), family.std(*own), 1.0, sd) for own, sd in scaled_by]
    means, sds = (np.array([_finite(each) for each in moment]) for moment in zip(*moments, strict=True))
    mean = means.mean(axis=0)
    spread = np.sqrt((sds**2 + (means - mean) ** 2).mean(axis=0))
    if len(factors) == 1:
        ((own, relative_sd),) = scaled_by
        return np.array([mean, spread, *(scaled_quantiles(family, own, 1.0, relative_sd, q) for q in TAILS)])
    if not any(relative_sd for _, relative_sd in factors):
        either = EquallyProbable([family(*own) for own, _ in scaled_by])
        return np.array([mean, spread, *(either.ppf(np.full(mean.shape, q)) for q in TAILS)])
    rows = [
        EquallyProbable(
            [scaled(family(*(each[row] for each in own)), 1.0, relative_sd=sd) for own, sd in scaled_by]
        ).ppf(TAILS)
        for row in range(mean.size)
    ]
    return np.array([mean, spread, *np.transpose(rows)])


def _answered(
    table: Array,
    used: Mask,
    decays: FreeDecays,
    flags: Integers,
    white: Mask,
    straight: Mask,
    fits: Fits,
    fit_of: Callable[[FreeDecay], Fit],
) -> tuple[Array, dict[int, tuple[FreeDecay, bool]]]:
    """Add the columns of a random force, and answer as :func:`friction_bayes.estimate` does.

    But where a glance at the residual shows white noise alone, the fit is the answer, with what the
    amplitudes say of other losses by their probability unless that is sure, and nothing of them in records
    that are ``straight``: what ``estimate`` adds to that is a force that is not excluded. ``used`` is left
    with the records that were answered, ``flags`` with what their forces are warned of for. Returned too are
    the decays that were looked at, by row, and whether their loss is surely uneven.
    """
    table = np.column_stack([table, np.full((len(table), len(_FORCE_COLUMNS)), np.nan)])
    column = {name: i for i, name in enumerate((*_COLUMNS, *_FORCE_COLUMNS))}
    system, kind, unit = decays.system, decays.quantity, decays.unit
    looked_at: dict[int, tuple[FreeDecay, bool]] = {}

    def write(row: int, answer: Any, frequency: float, frequency_sd: float, **new: float) -> None:
        factors = force_factors(system, kind, unit, frequency, frequency_sd)
        own = _moments_and_tails(answer)
        friction, length = factors[0].factor * own, frequency**-kind.order * own
        if len(factors) > 1 or factors[0].relative_sd > 0.0:
            mixed = equally_probable([scaled(answer, f, relative_sd=sd) for f, sd in factors])
            friction = _moments_and_tails(mixed)
        for k, of in enumerate(("mean", "sd", "low", "high")):
            new |= {f"friction_{of}": friction[k], f"friction_over_stiffness_{of}": length[k]}
        for name, value in (new | {"frequency": frequency, "frequency_sd": frequency_sd}).items():
            table[row, column[name]] = value

    as_fitted = white & (table[:, column["friction_low"]] > 0.0)
    for row in np.flatnonzero(used & as_fitted & ~straight).tolist():
        decay = decays.decay(row)
        uneven = uneven_loss(decay)
        if uneven is None or uneven.sure:
            as_fitted[row] = False
            continue
        looked_at[row] = decay, False
        degrees, location, scale = (float(each[row]) for each in fits.parameters)
        fitted = stats.t(df=degrees, loc=location, scale=scale)
        answer = not_negative(answer_parts(fitted, None, uneven))
        write(row, answer, float(fits.frequency[row]), float(fits.frequency_sd[row]))
    for row in np.flatnonzero(used & ~as_fitted).tolist():
        try:
            decay, fit, accounts = free_part(decays.without_dropouts(row), fit_of)
            fit = averaged_over_accounts(decay, fit, accounts.all)
            refusal = NOT_DECAYING if fit.surely_negative else _OK
        except InputError:
            # no decay fits the part that is free
            refusal = _NO_FIT
        if refusal != _OK:
            _refuse(table, row, refusal)
            used[row] = False
            continue
        looked_at[row] = decay, _sure(fit.uneven_loss)
        flags[row] &= ~_BIT["negative_friction"]
        flags[row] |= _BIT["push"] * rather_a_push(fit.random_force)
        new = {"noise_sd": fit.noise_sd, "rest_position": fit.rest_position}
        if fit.random_force is not None:
            new["random_force_probability"] = fit.random_force.probability
            new["random_force_sd"] = float(fit.random_force.sd.mean()) * force_factor(system, kind, unit)
        write(row, fit.answer, fit.frequency, fit.frequency_sd, **new)
    return table, looked_at


def _moments_and_tails(distribution: Any) -> Array:
    """Mean, sd and ends of the 90 % interval; these side by side, as a mixture's take sixty halvings each."""
    return np.array([distribution.mean(), distribution.std(), *distribution.ppf(np.array(TAILS))])


def _finite(values: Array) -> Array:
    """The moments that exist; nan for the others."""
    return np.where(np.isfinite(values), values, np.nan)


def _as_dataset(
    table: xr.DataArray, columns: tuple[str, ...], system: Oscillator, kind: Quantity, unit: str
) -> xr.Dataset:
    """Name the columns and say what they hold."""
    column = {name: table.isel(column=i) for i, name in enumerate(columns)}
    force, length = friction_unit(system, unit), length_unit(system, kind, unit)

    def interval(name: str) -> xr.DataArray:
        both = xr.concat([column[f"{name}_low"], column[f"{name}_high"]], dim="bound")
        return both.transpose(..., "bound")

    units = {
        "friction_mean": force,
        "friction_sd": force,
        "friction_interval90": force,
        "friction_over_stiffness_mean": length,
        "friction_over_stiffness_sd": length,
        "friction_over_stiffness_interval90": length,
        "noise_sd": unit,
        "frequency": "rad/s",
        "frequency_sd": "rad/s",
        "rest_position": unit,
    }
    units |= {name: unit for name, unit in zip(_FORCE_COLUMNS, ("1", force), strict=True) if name in column}
    result = xr.Dataset(
        {
            name: (
                interval(name.removesuffix("_interval90")) if name.endswith("interval90") else column[name]
            )
            for name in units
        },
        coords={"bound": ["low", "high"]},
        attrs={"quantity": kind.name},
    )
    result["status"] = column["status"].astype(np.int8)
    for name, value in units.items():
        result[name].attrs["units"] = value
    if "warnings" in column:
        result["warnings"] = column["warnings"].astype(np.int16)
        result["warnings"].attrs = {
            "flag_masks": np.array(list(_BIT.values()), dtype=np.int16),
            "flag_meanings": " ".join(WARNINGS),
        }
    result["status"].attrs = {
        "flag_values": np.arange(len(STATUS), dtype=np.int8),
        "flag_meanings": " ".join(STATUS),
    }
    return result
