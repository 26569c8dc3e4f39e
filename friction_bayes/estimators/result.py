"""The result of an estimate: a fit in the unit of its signal, converted to a force."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from friction_bayes.conjugate.scaled_distribution import scaled
from friction_bayes.core.declared_force import (
    ForceFactor,
    by_stiffness_and_mass,
    disagreement,
    frequencies_disagree,
)
from friction_bayes.core.displays import Shown
from friction_bayes.core.errors import RecordWarning
from friction_bayes.core.strict_json import plain
from friction_bayes.core.summary import Summary, summary_arrays, summary_table
from friction_bayes.core.system import Oscillator
from friction_bayes.core.text import interval90, number
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.sensor_calibration import (
    force_factors,
    length_unit,
)
from friction_bayes.estimators.acceptance import Acceptance
from friction_bayes.estimators.base import Fit, RandomForce
from friction_bayes.estimators.equally_probable import equally_probable
from friction_bayes.estimators.noise.noise_accounts import most_probable
from friction_bayes.estimators.noise.other_forces import BENT

__all__ = ["Estimate", "far_apart", "force_notes", "force_of", "rather_a_push"]

_NO_FLUCTUATION = 5.0
"""Times friction itself, beyond which a random force is rather another effect: a warning is given then."""
_SUSPECT_PERIODS = 0.02
"""Correlation time of a random force below which a note doubts that it is one: the prior ends at 0.01."""
_SUMMARISED = ("friction", "friction_over_stiffness", "precision", "frequency", "noise_sd", "rest_position")
"""Fields of an estimate with a row in its summary."""
_WORTH_A_WARNING = 0.03
"""Relative difference of the frequencies found and declared above which a warning is given too."""


@dataclass(frozen=True, kw_only=True)
class Estimate(Shown):
    """Friction of one free decay.

    Attributes
    ----------
    method : str
        Name of the estimator.
    decay : FreeDecay
        The moving part of the record.
    fit : Fit
        The estimator's own result, in the unit of the signal.
    prior : dict
        The prior used, by key.
    peaks : str
        How the paper's two methods picked amplitudes.
    acceptance : Acceptance or None
        Judgement by the precision parameter; None when neither threshold nor set-up record was given.
    notes : tuple of str
        Remarks for the reader of the numbers.
    friction : frozen scipy.stats distribution
        Posterior of the friction force, with the uncertainty of mass and stiffness: their standard
        deviations, and which of them is right where the record does not swing at their frequency.
    friction_unit : str
        N or N m; the signal's own unit where the sensor was not calibrated.
    friction_as_declared : frozen scipy.stats distribution
        The same with mass and stiffness taken as exact, without the witness.
    friction_of_parts : frozen scipy.stats distribution
        The posterior that a sampler samples: that, by the parts of it which count.
    force_factors : tuple of ForceFactor
        From the signal's friction coefficient to the friction force, one or two equally probable.
    force_factor : float
        From the signal's friction coefficient to the friction force at the declared mass and stiffness.
    friction_over_stiffness : frozen scipy.stats distribution
        Posterior of ``r/k``, seen in the signal whatever mass and stiffness are.
    friction_over_stiffness_unit : str
        m or rad; the signal's own unit times seconds per order of derivative where not calibrated.
    precision : frozen scipy.stats distribution or None
        Posterior of the precision parameter of the model.
    precision_unit : str
        Its unit.
    amplitudes : int
        How many amplitudes were used, or lie in the moving record.
    frequency, frequency_sd : float
        Angular frequency found [rad/s]; its sd is nan where the method does not estimate it.
    noise_sd : float
        Standard deviation of a sample of the signal; nan where the method has none.
    rest_position : float
        In the unit of the signal.
    accepted : bool or None
        Whether the precision parameter is high enough; None without a value to compare it with.
    probability_negative : float
        ``P(friction < 0)`` under the model, before the reported friction is truncated at zero.
    random_force : RandomForce or None
        Posterior of a random force, its size in the unit of friction at the declared mass and stiffness.
    """

    method: str
    decay: FreeDecay
    fit: Fit
    prior: dict[str, float]
    peaks: str
    acceptance: Acceptance | None
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        friction = Summary.of_distribution(self.friction, self.friction_unit).to_dict()
        return (
            f"Estimate({self.decay.name}, {self.method}: friction {number(friction['mean'])} "
            f"{friction['unit']}, 90 %: {interval90(friction)})"
        )

    @cached_property
    def friction(self) -> Any:
        return force_of(self.decay, self.fit, self.fit.answer)

    @property
    def friction_unit(self) -> str:
        return self.decay.friction_unit

    @cached_property
    def friction_of_parts(self) -> Any:
        return scaled(self.fit.coefficient_of_parts, self.force_factor)

    @cached_property
    def friction_as_declared(self) -> Any:
        return scaled(self.fit.coefficient, self.force_factor)

    @property
    def force_factors(self) -> tuple[ForceFactor, ...]:
        return _force_factors(self.decay, self.fit)

    @property
    def force_factor(self) -> float:
        return self.decay.force_factor

    @cached_property
    def friction_over_stiffness(self) -> Any:
        return scaled(self.fit.answer, self.fit.frequency**-self.decay.quantity.order)

    @property
    def friction_over_stiffness_unit(self) -> str:
        return length_unit(self.decay.system, self.decay.quantity, self.decay.unit)

    @property
    def precision(self) -> Any | None:
        return self.fit.precision

    @property
    def precision_unit(self) -> str:
        return self.fit.precision_unit

    @property
    def amplitudes(self) -> int:
        return self.fit.amplitudes

    @property
    def frequency(self) -> float:
        return self.fit.frequency

    @property
    def frequency_sd(self) -> float:
        return self.fit.frequency_sd

    @property
    def noise_sd(self) -> float:
        return self.fit.noise_sd

    @property
    def rest_position(self) -> float:
        return self.fit.rest_position

    @property
    def accepted(self) -> bool | None:
        return None if self.acceptance is None else self.acceptance.accepted

    @property
    def probability_negative(self) -> float:
        return self.fit.probability_negative

    @cached_property
    def random_force(self) -> RandomForce | None:
        found = self.fit.random_force
        if found is None:
            return None
        sizes = {
            name: scaled(getattr(found, name), self.force_factor)
            for name in ("sd", "coefficient_without", "coefficient_with")
        }
        return replace(found, **sizes)

    def summary(self) -> Any:
        """Return the numbers as a table, as ``arviz.summary`` lays them out.

        Returns
        -------
        pandas.DataFrame
            As :func:`friction_bayes.core.summary.summary_table` describes; a random force, where one was
            evaluated, as it is if there is one.
        """
        return summary_table(self._summaries())

    def _summaries(self) -> dict[str, dict[str, Any]]:
        as_reported = self.to_dict()
        rows = {name: as_reported[name] for name in _SUMMARISED if as_reported[name] is not None}
        for name in ("sd", "correlation_time") if as_reported["random_force"] else ():
            rows[f"random_force.{name}"] = as_reported["random_force"][name]
        return rows

    def to_xarray(self) -> xr.Dataset:
        """Return signal, fit and residual over ``time``, and the numbers over ``statistic``.

        Returns
        -------
        xarray.Dataset
            ``signal``, ``fitted`` and ``residual`` over ``time`` [s] (the last two of methods that predict
            the signal), and the numbers of :meth:`summary` as
            :func:`friction_bayes.core.summary.summary_arrays` describes.
        """
        return self._over_time().merge(summary_arrays(self._summaries()))

    def to_datatree(self) -> xr.DataTree:
        """Return the same in two groups, as a closed loop has them.

        Returns
        -------
        xarray.DataTree
            ``summary`` has the numbers, ``records/0`` signal, fit and residual.
        """
        groups = {"summary": summary_arrays(self._summaries()), "records/0": self._over_time()}
        return xr.DataTree.from_dict(groups)

    def _over_time(self) -> xr.Dataset:
        values = {"signal": self.decay.values}
        if self.fit.prediction is not None:
            values |= {"fitted": self.fit.prediction, "residual": self.decay.values - self.fit.prediction}
        time = self.decay.start_time + self.decay.time
        return xr.Dataset(
            {name: ("time", each, {"units": self.decay.unit}) for name, each in values.items()},
            coords={"time": ("time", time, {"units": "s"})},
            attrs={
                "record": self.decay.name,
                "method": self.method,
                "quantity": self.decay.quantity.name,
            },
        )

    def to_dict(self, reference: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return everything as plain numbers and words, for JSON; None where there is no number.

        Parameters
        ----------
        reference : mapping, optional
            What a sampler made of the same posterior.
        """
        system = self.decay.system
        friction = Summary.of_distribution(self.friction, self.friction_unit)
        over_stiffness = Summary.of_distribution(
            self.friction_over_stiffness, self.friction_over_stiffness_unit
        )
        precision = None
        if self.precision is not None:
            precision = Summary.of_distribution(self.precision, self.precision_unit).to_dict()
        return plain(
            {
                "method": self.method,
                "friction": friction.to_dict(),
                "friction_over_stiffness": over_stiffness.to_dict(),
                "precision": precision,
                "accepted": self.accepted,
                "acceptance": None if self.acceptance is None else asdict(self.acceptance),
                "amplitudes": self.amplitudes,
                "reference": None if reference is None else dict(reference),
                "record": self.decay.name,
                "probability_negative": self.probability_negative,
                "frequency": {
                    "mean": self.frequency,
                    "sd": self.frequency_sd,
                    "declared": system.natural_frequency,
                    "unit": "rad/s",
                },
                "noise": {
                    "model": self.fit.noise_model,
                    "sd": self.noise_sd,
                    "unit": self.decay.unit,
                    "probability_of_free_corners": self.fit.probability_of_free_corners,
                    "filter": self._filter_summary(),
                },
                "noise_sd": {"mean": self.noise_sd, "unit": self.decay.unit},
                "witness": self._witness_summary(),
                "uneven_loss": self._uneven_loss_summary(),
                **{name: self._bent_summary(name) for name in BENT},
                "fitted": {
                    "from_s": self.decay.start_time,
                    "to_s": self.decay.start_time + self.decay.duration,
                    "samples": self.decay.values.size,
                    "half_cycles": self.decay.half_cycles,
                    "stray_samples_at_s": sorted(self.decay.stray),
                    "interference_at_hz": sorted(self.decay.lines),
                    "zero_drift": {"range": self.decay.drift, "unit": self.decay.unit},
                },
                "rest_position": {"mean": self.rest_position, "unit": self.decay.unit},
                "prior": self.prior,
                "peaks": self.peaks,
                "random_force": self._random_force_summary(),
                "includes_system_uncertainty": not _taken_as_exact(self.force_factors),
                "notes": self.notes,
            }
        )

    @cached_property
    def witness(self) -> Any | None:
        """Posterior of the friction force by the loss of amplitude alone; None where there is no witness."""
        if self.fit.witness is None:
            return None
        return force_of(self.decay, self.fit, self.fit.witness.coefficient)

    def _witness_summary(self) -> dict[str, Any] | None:
        if self.fit.witness is None:
            return None
        friction = Summary.of_distribution(self.witness, self.friction_unit)
        return {"friction": friction.to_dict(), "agrees": self.fit.witness.agrees}

    def _uneven_loss_summary(self) -> dict[str, Any] | None:
        uneven = self.fit.uneven_loss
        if uneven is None:
            return None
        force = force_of(self.decay, self.fit, uneven.coefficient)
        friction = Summary.of_distribution(force, self.friction_unit)
        return {
            "probability": uneven.probability,
            "faster": uneven.faster,
            "friction": friction.to_dict(),
            "losses": uneven.losses,
        }

    def _bent_summary(self, name: str) -> dict[str, float] | None:
        if not self.fit.accounts:
            return None
        probability, share = self.fit.bent(name)
        return {"probability": probability, "share_at_largest_swing": share}

    def _filter_summary(self) -> dict[str, Any] | None:
        behind = self.fit.filter
        return None if behind is None else behind._asdict()

    def _random_force_summary(self) -> dict[str, Any] | None:
        force = self.random_force
        if force is None:
            return None
        return {
            "probability": force.probability,
            "sd": Summary.of_distribution(force.sd, self.friction_unit).to_dict(),
            "share_of_friction": force.share_of_friction,
            "correlation_time": Summary.of_distribution(force.correlation_time, "s").to_dict(),
        }


def _force_factors(decay: FreeDecay, fit: Fit) -> tuple[ForceFactor, ...]:
    return force_factors(decay.system, decay.quantity, decay.unit, fit.frequency, fit.frequency_sd)


def force_of(decay: FreeDecay, fit: Fit, coefficient: Any) -> Any:
    """Distribution of the force of a coefficient of the signal, by what the fit says of the system."""
    return equally_probable([scaled(coefficient, f, relative_sd=sd) for f, sd in _force_factors(decay, fit)])


def _taken_as_exact(factors: tuple[ForceFactor, ...]) -> bool:
    return len(factors) == 1 and factors[0].relative_sd == 0.0


def force_notes(decay: FreeDecay, fit: Fit, *, slower_swings: bool = False) -> list[str]:
    """Notes on the friction force that follows from a fit of the signal.

    With ``slower_swings`` the frequency is known to be that of large swings, which are slower.

    Warns
    -----
    RecordWarning
        If the record swings far from the frequency that mass and stiffness imply.
    """
    system, order = decay.system, decay.quantity.order
    notes = []
    if not decay.calibrated:
        notes.append(
            "the sensor is not calibrated: friction is the friction force over "
            f"{_factor_symbol(system, order)}, in the signal's own unit, {decay.unit}"
        )
    notes += _negative_note(fit) + _frequency_note(decay, fit, slower_swings) + _random_force_notes(fit)
    if decay.calibrated and _taken_as_exact(_force_factors(decay, fit)):
        notes.append(f"{_exact(system, order)} uncertainty is not in the friction interval")
    return notes


def far_apart(system: Oscillator, frequency: ArrayLike, frequency_sd: ArrayLike) -> Any:
    """Whether frequencies found [rad/s] are so far from the declared one that a warning is given."""
    apart = np.abs(np.asarray(frequency) / system.natural_frequency - 1.0) > _WORTH_A_WARNING
    return (apart & frequencies_disagree(system, frequency, frequency_sd))[()]


def rather_a_push(force: RandomForce | None) -> bool:
    """Whether a random force is so large that it is rather another effect, and a warning is given."""
    return force is not None and force.probability > 0.5 and force.share_of_friction > _NO_FLUCTUATION


def _negative_note(fit: Fit) -> list[str]:
    """Warn of a friction that is certainly below zero."""
    if not fit.surely_negative:
        return []
    text = (
        "friction is negative, which no contact has: the oscillation grows, or an error of the sensor "
        "goes with the direction of motion, which closing the loop looks for"
    )
    warnings.warn(text, RecordWarning, stacklevel=4)
    return [text]


def _random_force_notes(fit: Fit) -> list[str]:
    """Notes on whether a random force is one, and whether it explains the residuals."""
    force = fit.random_force
    if force is None or force.probability <= 0.5:
        return []
    notes = []
    if rather_a_push(force):
        notes.append(
            f"in addition to friction a force would have to act {force.share_of_friction:.0f} times as "
            "large, which is rather a push, another law or an error of the sensor: closing the loop, or a "
            "part of the record, shows which"
        )
        warnings.warn(notes[0], RecordWarning, stacklevel=4)
    notes += [
        "an effect that dry friction alone lacks, such as viscous damping, can pass for such a force and "
        "shift friction by more than the interval; closing the loop separates them",
    ]
    periods = float(force.correlation_time.mean()) * fit.frequency / (2.0 * math.pi)
    if periods < _SUSPECT_PERIODS:
        notes.append(
            f"{periods:.2g} periods is as short as a random force is looked for: more likely it is an effect "
            "that the model lacks, or wrong time stamps; closing the loop looks for it"
        )
    test = force.innovations
    best = most_probable(each for each in fit.accounts if each.forced)
    # noise that is taken to be white where it is weaker cannot leave white residuals
    if not (test.white or best.weaker_above):
        notes.append(
            "even so the residuals are not white noise: successive ones correlate at "
            f"{test.lag1:.3f}: the model lacks an effect; closing the loop looks for it"
        )
    return notes


def _factor_symbol(system: Oscillator, order: int) -> str:
    moving = system.moving_name
    return ("the stiffness", f"sqrt(stiffness * {moving})", f"the {moving}")[order]


def _exact(system: Oscillator, order: int) -> str:
    """A note on which of mass and stiffness is taken as exact."""
    if system.trust is not None:
        return f"the {system.trust} is taken as exact: its"
    moving = system.moving_name
    return (
        "the stiffness is taken as exact: its",
        f"{moving} and stiffness are taken as exact: their",
        f"the {moving} is taken as exact: its",
    )[order]


def _frequency_note(decay: FreeDecay, fit: Fit, slower_swings: bool) -> list[str]:
    """Notes with both frequencies and both forces where these are not the declared system's."""
    system, found, sd = decay.system, fit.frequency, fit.frequency_sd
    if not frequencies_disagree(system, found, sd):
        return []
    apart = float(disagreement(system, found, sd))
    text = f"the record {decay.both_frequencies(found)}, {apart:.0f} standard deviations apart: "
    far = "" if slower_swings else decay.far_from_declared(found)
    text += far and f"{far}; "
    if decay.calibrated:
        coefficient, unit = float(fit.coefficient.mean()), system.friction_unit
        forces = by_stiffness_and_mass(system, decay.quantity, found, coefficient)
        text += (
            f"friction is {forces[0]:.4g} {unit} with the declared stiffness "
            f"and {forces[1]:.4g} {unit} with the declared {system.moving_name}; "
        )
        text += (
            "its interval spans both, as equally probable, unless one of them is trusted"
            if system.trust is None
            else f"the {system.trust} is trusted"
        )
    else:
        text += f"friction in {decay.unit} does not depend on them, but a force computed from it would"
        text += "" if far else f": check {system.moving_name} and stiffness"
    if far_apart(system, found, sd):
        warnings.warn(text, RecordWarning, stacklevel=4)
    return [text]
