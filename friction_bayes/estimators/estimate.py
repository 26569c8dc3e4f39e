"""From a record to a friction force: the public entry to the closed-form estimators."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass, replace
from functools import partial
from typing import Any

import xarray as xr

from friction_bayes.core.blas import single_threaded_blas
from friction_bayes.core.checks import positive
from friction_bayes.core.errors import InputError, RecordWarning, unknown_name
from friction_bayes.core.summary import TAILS
from friction_bayes.core.system import Oscillator, check_system
from friction_bayes.core.text import interval, listed, number, percent, words
from friction_bayes.decay.dropouts import set_dropouts_aside
from friction_bayes.decay.excursions import set_excursions_aside
from friction_bayes.decay.free_decay import FreeDecay, find_free_decay
from friction_bayes.decay.friction_samples import PEAKS
from friction_bayes.decay.pendulum_likeness import pendulum_notes
from friction_bayes.estimators.acceptance import Acceptance, accept_by_set_up, accept_by_threshold
from friction_bayes.estimators.base import Fit
from friction_bayes.estimators.envelope.loss_of_amplitude import UNEVEN_PRIOR, uneven_loss
from friction_bayes.estimators.noise.noise_accounts import SLIGHT
from friction_bayes.estimators.noise.other_forces import BENT
from friction_bayes.estimators.priors import complete_prior
from friction_bayes.estimators.registry import estimator_named
from friction_bayes.estimators.result import Estimate, force_notes, force_of
from friction_bayes.estimators.waveform.averaged import averaged_over_accounts
from friction_bayes.estimators.waveform.estimator import WaveformEstimator
from friction_bayes.estimators.waveform.free_part import free_part
from friction_bayes.estimators.waveform.saturation import refuse_saturated
from friction_bayes.records.clipping import clipped_fraction
from friction_bayes.records.readings_alone import readings_alone
from friction_bayes.records.record import record_name, validate_record
from friction_bayes.records.rounded_stamps import with_even_stamps
from friction_bayes.records.starting_over import while_going_on

__all__ = [
    "RANDOM_FORCE_CHOICES",
    "check_choices",
    "estimate",
    "prior_mapping",
    "refuse_clipped",
]

RANDOM_FORCE_CHOICES = ("auto", "none")
"""Whether a random force may be there."""

_MAY_BE_NONE = 0.01
"""Probability of damping without dry friction from which on no number is given for friction."""
_FASTER = ("faster", "as under viscous damping, drag or friction that falls with time", "with damping")
_SLOWER = (
    "slower",
    "as under friction that grows with time or as the motion slows, or of a sensor that shows large swings "
    "too small",
    "at small swings",
)
"""How the amplitude falls while it is larger, under what, and of which law friction is then reported."""
_SPLINE = (
    "the times are uneven: this method goes from sample to sample, so that a cubic spline brings the signal "
    "to an even grid; waveform takes the samples at their own times"
)


def refuse_clipped(record: xr.DataArray) -> None:
    """Refuse a record that was cut off at the end of the sensor's range.

    Raises
    ------
    InputError
        Saying how much of it lies flat, and at which level.
    """
    fraction, level = clipped_fraction(record.values)
    if level is not None:
        raise InputError(
            record_name(record),
            f"clipped: {100.0 * fraction:.2f} % of the samples lie flat at {level:.6g} "
            f"{record.attrs['units']}",
            "use close-loop, which treats them as censored, or a sensor with more range",
        )


def estimate(
    record: xr.DataArray,
    system: Oscillator,
    *,
    method: str = "waveform",
    prior: Mapping[str, float] | Any | None = None,
    peaks: str = "highest",
    setup: xr.DataArray | None = None,
    accept_precision: float | None = None,
    start: float | None = None,
    rest_position: float | None = None,
    random_force: str = "auto",
) -> Estimate:
    """Estimate friction from one free decay, in closed form.

    Parameters
    ----------
    record : xarray.DataArray
        The record, from :func:`read_record`, :func:`simulate` or :func:`make_record`.
    system : Oscillator
        Mass or inertia, and stiffness.
    method : str
        ``waveform``, ``envelope``, ``normal-gamma`` or ``gamma-exponential``, or one registered from outside.
    prior : mapping or conjugate prior, optional
        Prior parameters by key, or the prior object itself; what is not given is the method's
        default, which comes from the declared system and never from the data.
    peaks : {"highest", "nominal"}
        How the paper's two methods pick amplitudes: the highest sample of each period, or the sample
        at the instant where the peak is due.
    setup : xarray.DataArray, optional
        A long record of the set-up phase, same quantity: the estimate is accepted where its precision
        parameter is not below that of this record by more than
        :func:`friction_bayes.estimators.acceptance.accept_by_set_up` allows.
    accept_precision : float, optional
        The least precision accepted, instead of ``setup``.
    start : float, optional
        When the free decay begins [s]; found when left out, after a hand has let go.
    rest_position : float, optional
        Signal at rest, unit of the signal; found when left out.
    random_force : {"auto", "none"}
        Whether method ``waveform`` averages over models with and without a random force; the other methods
        have no random force.

    Returns
    -------
    Estimate

    Raises
    ------
    InputError
        If the record cannot be used (clipped, too short, constant, ...) or an argument is wrong.

    Warns
    -----
    RecordWarning
        Of samples set aside, of a decay without dry friction, and of a frequency far from the declared one.
    """
    check_system(system)
    if setup is not None and accept_precision is not None:
        raise InputError("setup", "given together with accept_precision", "give one of them")
    if accept_precision is not None:
        positive("accept_precision", accept_precision)
    check_choices(peaks, random_force)
    estimator = estimator_named(method)
    # not a decorator: its frame would take the place of the caller's line in warnings
    with single_threaded_blas():
        validate_record(record)
        record, dropouts = set_dropouts_aside(with_even_stamps(while_going_on(record)), system)
        record, _ = set_excursions_aside(readings_alone(record, system.natural_frequency)[0], system)
        refuse_clipped(record)
        decay = find_free_decay(record, system, start=start, rest_position=rest_position)
        refuse_saturated(decay)
        by_samples = method == WaveformEstimator.name
        spline = [_SPLINE] * (not by_samples and not decay.evenly_spaced)
        decay = decay.without_samples_at(dropouts) if by_samples else decay.on_even_grid()
        chosen = complete_prior(estimator.name, estimator.default_prior(decay), prior_mapping(prior))
        fit_of = partial(estimator.fit, prior=chosen, peaks=peaks)
        if random_force == "auto" and by_samples:
            part = free_part(decay, fit_of, from_here=start is not None)
            decay, fit = part.decay, averaged_over_accounts(part.decay, part.fit, part.accounts.all)
            _refuse_negative(decay, fit)
            for note in decay.cut_notes:
                warnings.warn(note, RecordWarning, stacklevel=2)
        else:
            fit = replace(fit_of(decay), uneven_loss=uneven_loss(decay))
        warned = _uneven_loss_note(decay, fit) + _bent_notes(decay, fit)
        pendulum = pendulum_notes(decay)
        force = force_notes(decay, fit, slower_swings=bool(pendulum))
        acceptance = None
        if accept_precision is not None:
            precision = _precision_of(fit, method)
            acceptance = accept_by_threshold(precision, accept_precision, unit=fit.precision_unit)
        elif setup is not None:
            reference = estimate(setup, system, method=method, prior=prior, peaks=peaks, random_force="none")
            acceptance = _accept_by_set_up(decay, fit, reference)
        return Estimate(
            method=method,
            decay=decay,
            fit=fit,
            prior=chosen,
            peaks=peaks,
            acceptance=acceptance,
            notes=(*warned, *pendulum, *decay.notes, *fit.notes, *force, *spline, *_provenance(record)),
        )


def check_choices(peaks: str, random_force: str) -> None:
    """Refuse an unknown way of picking amplitudes or of treating a random force.

    Raises
    ------
    InputError
        With the choices that there are.
    """
    given = {"peaks": (peaks, PEAKS), "random_force": (random_force, RANDOM_FORCE_CHOICES)}
    for name, (choice, choices) in given.items():
        if choice not in choices:
            raise unknown_name(name, "choice", choice, choices)


def prior_mapping(prior: Any) -> Mapping[str, float] | None:
    """Return a prior as numbers by key: a mapping as it is, a conjugate prior by its parameters."""
    if prior is None or isinstance(prior, Mapping):
        return prior
    if is_dataclass(prior) and not isinstance(prior, type):
        return asdict(prior)
    raise InputError("prior", f"{prior!r} is not a prior", "give a mapping of numbers or a conjugate prior")


def _precision_of(fit: Fit, method: str) -> Any:
    if fit.precision is None:
        raise InputError(
            "method", f"{method} has no precision parameter to accept by", "use normal-gamma or waveform"
        )
    return fit.precision


def _refuse_negative(decay: FreeDecay, fit: Fit) -> None:
    """Refuse a decay that loses no amplitude by any account."""
    if fit.surely_negative:
        raise InputError(
            decay.name,
            "friction is negative, which no contact has: the oscillation grows, as if driven",
            "give the free decay alone (--start, --end)",
        )


def _accept_by_set_up(decay: FreeDecay, fit: Fit, reference: Estimate) -> Acceptance:
    """Acceptance by the precision of a record of the same sensor in the set-up phase."""
    set_up, method = reference.decay, reference.method
    if (decay.quantity, decay.unit) != (set_up.quantity, set_up.unit):
        raise InputError(
            set_up.name,
            f"holds {set_up.quantity.name} [{set_up.unit}], not {decay.quantity.name} [{decay.unit}]",
            "give a set-up record of the same sensor",
        )
    least = _precision_of(reference.fit, method)
    return accept_by_set_up(_precision_of(fit, method), least, unit=fit.precision_unit)


def _uneven_loss_note(decay: FreeDecay, fit: Fit) -> list[str]:
    """Note of a loss that need not be by dry friction alone: what friction is with it, and without.

    In full where the record makes that more probable than it was before; a warning where it surely is not.
    Intervals, as the standard deviation after few half cycles is infinite.
    """
    uneven = fit.uneven_loss
    if uneven is None or uneven.probability < SLIGHT:
        return []

    def of(coefficient: Any) -> str:
        force = force_of(decay, fit, coefficient)
        low, high = (float(force.ppf(p)) for p in TAILS)
        return f"{interval(low, high, 3)} {decay.friction_unit} (90 %)"

    falls, (how, under, then) = "falls" if uneven.sure else "may fall", _FASTER if uneven.faster else _SLOWER
    if uneven.losses:
        likely = sorted(uneven.losses.items(), key=lambda loss: -loss[1])
        named = [f"{words(name)} ({percent(share)})" for name, share in likely if share >= SLIGHT]
        under, then = f"as under {listed(named, 'or')}", "then"
    may_be_none = float(uneven.coefficient.cdf(0.0)) > _MAY_BE_NONE
    friction = "there need be no dry friction" if may_be_none else f"dry friction is {of(uneven.coefficient)}"
    if uneven.probability < sum(UNEVEN_PRIOR.values()):
        # too little for the interval, and all that slight damping does to friction
        said = [
            f"{decay.name}: should more than dry friction act (probability {number(uneven.probability, 2)}), "
            f"{friction}"
        ]
        return said if uneven.losses else []
    then += f" {friction}"
    if uneven.losses:
        alone = "" if uneven.sure else " and dry friction alone"
        reported = f"and it is averaged over these{alone}"
    else:
        spans = "spans both" if uneven.sure else "reaches from the one towards the other by that probability"
        answer = "this is reported" if fit.witness is None else f"the interval reported {spans}"
        reported = f"alone it would have to be {of(fit.coefficient)}, and {answer}"
    text = (
        f"{decay.name}: the amplitude {falls} {how} while it is larger (probability "
        f"{number(uneven.probability, 3)}), {under}: {then}, {reported}; closing the loop (close-loop) "
        "separates them"
    )
    if uneven.sure:
        warnings.warn(text, RecordWarning, stacklevel=3)
    return [text]


def _bent_notes(decay: FreeDecay, fit: Fit) -> list[str]:
    """Notes of a frequency, and of a scale, that change with the swing, where they probably do."""
    (of_spring, stiffer), (of_scale, _) = (fit.bent(name) for name in BENT)
    notes = []
    if of_spring >= 0.5:
        notes.append(
            f"the frequency changes with the swing (probability {number(of_spring, 3)}), as on a spring "
            f"{percent(abs(stiffer))} {'stiffer' if stiffer > 0.0 else 'softer'} at the largest"
        )
    if of_scale >= 0.5:
        notes.append(f"the scale of the sensor is bent (probability {number(of_scale, 3)})")
    return [f"{decay.name}: {note}: friction is averaged over that" for note in notes]


def _provenance(record: xr.DataArray) -> list[str]:
    """Remarks of a data set on its record and its system, and what was done to the samples."""
    notes = ["the record is synthetic"] if record.attrs.get("synthetic") else []
    named = {"note": "the record", "system_source": "the declared system"}
    notes += [f"{name}: {record.attrs[key]}" for key, name in named.items() if record.attrs.get(key)]
    return notes
