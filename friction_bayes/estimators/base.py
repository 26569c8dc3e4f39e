"""The protocol of an estimator, its inputs and its results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.core.arrays import Array, Indices, Integers, Mask
from friction_bayes.core.quantities import Quantity
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.located import FOUND, Located
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.decay.whiteness import Whiteness
from friction_bayes.estimators.envelope.loss_of_amplitude import UnevenLoss
from friction_bayes.estimators.noise.noise_accounts import (
    UNLISTED,
    NoiseAccount,
    most_probable,
    total_probability,
)
from friction_bayes.estimators.posterior_part import PosteriorPart
from friction_bayes.estimators.priors import DeclaredSignal
from friction_bayes.estimators.witness import AnswerPart, Witness, answer_parts, not_negative

__all__ = [
    "SURELY_NEGATIVE",
    "BehindFilter",
    "Estimator",
    "Fit",
    "Fits",
    "FittedMotion",
    "FreeDecays",
    "Glance",
    "RandomForce",
]

SURELY_NEGATIVE = 0.99
"""Probability of a negative friction above which no answer is given."""


@dataclass(frozen=True, kw_only=True)
class RandomForce:
    """Posterior of a random force, an Ornstein-Uhlenbeck process.

    Attributes
    ----------
    probability : float
        That there is one.
    sd : frozen scipy.stats distribution
        Its standard deviation, given that there is one, in the unit of :attr:`Fit.coefficient`.
    correlation_time : frozen scipy.stats distribution
        Given that there is one [s].
    coefficient_without, coefficient_with : Mixture
        Friction coefficient of the signal without it, and with it.
    innovations : Whiteness
        Test of the whitened residuals at the most probable random force.
    """

    probability: float
    sd: Any
    correlation_time: Any
    coefficient_without: Mixture
    coefficient_with: Mixture
    innovations: Whiteness

    @property
    def share_of_friction(self) -> float:
        """Mean of its sd over the mean friction with it."""
        return float(self.sd.mean()) / abs(float(self.coefficient_with.mean()))


class BehindFilter(NamedTuple):
    """The most probable filter of a record.

    Attributes
    ----------
    name : str
        In words.
    gain : float
        On the motion.
    probability : float
        That there was a filter, this one or another.
    """

    name: str
    gain: float
    probability: float

    @classmethod
    def of(cls, accounts: Sequence[NoiseAccount]) -> BehindFilter | None:
        """By all accounts of a record; None where no filter is more probable."""
        unlisted = [each for each in accounts if each.unlisted is not None]
        listed = [each for each in accounts if each.filter is not None and each.unlisted is None]
        of_unlisted, of_listed = total_probability(unlisted), total_probability(listed)
        probability = of_unlisted + of_listed
        if probability <= 0.5:
            return None
        if of_unlisted > of_listed:
            gain = sum(each.probability * each.gain for each in unlisted) / of_unlisted
            return cls(UNLISTED, gain, probability)
        best = most_probable(listed)
        return None if best.filter is None else cls(best.filter.name, best.gain, probability)


@dataclass(frozen=True, eq=False)
class FittedMotion:
    """The motion that was fitted to a whole signal.

    Attributes
    ----------
    states : ndarray, shape (n, 2)
        Displacement about the rest position and velocity, times the power of the angular frequency that gives
        them the unit of the signal.
    phase_sd : float
        Standard deviation of the phase, where it is known least.
    """

    states: Array
    phase_sd: float


@dataclass(frozen=True, kw_only=True)
class Fit:
    """Result of an estimator for one free decay, in the units of the signal.

    Attributes
    ----------
    coefficient : frozen scipy.stats distribution or Mixture
        Posterior of the friction coefficient of the signal, ``u = w0**q r/k`` for derivative order ``q``;
        :meth:`friction_bayes.Oscillator.force_factor` turns it into a force.
    precision : frozen scipy.stats distribution or None
        Posterior of the model's precision parameter, 1/(unit of its data)**2.
    precision_unit : str
        Its unit.
    posterior : object
        The conjugate posterior itself (NormalGamma, GammaExponential, NormalInverseGamma).
    amplitudes : int
        How many amplitudes the model used, or the moving record contains.
    frequency, frequency_sd : float
        Angular frequency found in the data [rad/s] and its standard deviation (nan where not estimated).
    rest_position : float
        Rest position, unit of the signal.
    noise_sd : float
        Posterior mean standard deviation of a signal sample (nan where the model has none).
    prediction : ndarray or None, shape (n,)
        Fitted signal over ``decay.time``.
    build_target : callable, () -> Target
        Makes :attr:`target`.
    notes : tuple of str
        Remarks for the reader: assumptions, negative samples, residuals that are not noise.
    motion : FittedMotion or None
        Of a method that fits the whole signal.
    account_parts : tuple of PosteriorPart
        Those of the accounts that count.
    accounts : tuple of NoiseAccount
        Of the residual of a fit of the whole signal, that of white noise alone first; empty where they were
        not requested or could not be evaluated.
    parts : tuple of PosteriorPart
        Of the posterior, those that count; one where there are no accounts.
    coefficient_of_parts : frozen scipy.stats distribution or Mixture
        Friction coefficient by these parts, as a sampler samples them.
    random_force : RandomForce or None
        Its posterior; None where there are no accounts.
    witness : Witness or None
        Friction by the loss of amplitude, of a method that averages over accounts.
    uneven_loss : UnevenLoss or None
        Whether the loss of amplitude is not that of dry friction alone; None where there are too few half
        cycles, no amplitude is lost, or the amplitudes were not looked at.
    answer : frozen scipy.stats distribution or Mixture
        Friction coefficient as it is reported: ``coefficient``, with the witness and what an uneven loss
        leaves to friction, and not negative, where there are accounts or a witness.
    """

    coefficient: Any
    precision: Any | None
    precision_unit: str
    posterior: Any
    amplitudes: int
    frequency: float
    frequency_sd: float
    rest_position: float
    noise_sd: float
    prediction: Array | None
    build_target: Callable[[], Target] = field(repr=False)
    notes: tuple[str, ...] = ()
    motion: FittedMotion | None = None
    accounts: tuple[NoiseAccount, ...] = ()
    account_parts: tuple[PosteriorPart, ...] = ()
    random_force: RandomForce | None = None
    witness: Witness | None = None
    uneven_loss: UnevenLoss | None = None

    @property
    def parts(self) -> tuple[PosteriorPart, ...]:
        whole = PosteriorPart("the whole posterior", 1.0, False, self.coefficient, self.build_target)
        return self.account_parts or (whole,)

    @property
    def coefficient_of_parts(self) -> Any:
        if len(self.parts) == 1:
            return self.parts[0].coefficient
        shares = np.array([part.probability for part in self.parts])
        return Mixture.of([part.coefficient for part in self.parts], shares / shares.sum())

    @cached_property
    def answer(self) -> Any:
        known = self.witness is not None or self.accounts
        return not_negative(self._parts_of_answer) if known else self.coefficient

    @property
    def _parts_of_answer(self) -> list[AnswerPart]:
        return answer_parts(self.coefficient, self.witness, self.uneven_loss)

    @property
    def probability_negative(self) -> float:
        """Probability that friction is negative, before the answer is truncated at zero."""
        return sum(share * float(each.cdf(0.0)) for share, each in self._parts_of_answer)

    @property
    def surely_negative(self) -> bool:
        """Whether friction is negative: no amplitude is lost."""
        return self.probability_negative > SURELY_NEGATIVE

    @property
    def noise_model(self) -> str:
        """``coloured`` or ``white``: of the noise that is the more probable."""
        coloured = total_probability(each for each in self.accounts if not each.of_white_noise)
        return "coloured" if coloured > 0.5 else "white"

    @property
    def probability_of_free_corners(self) -> float:
        """Probability that the corners of the motion are not recorded as dry friction makes them."""
        return total_probability(account for account in self.accounts if account.free_corners)

    @property
    def filter(self) -> BehindFilter | None:
        """The most probable filter, if more probable than none; the answer is corrected for its gain."""
        return BehindFilter.of(self.accounts)

    def bent(self, name: str) -> tuple[float, float]:
        """Probability that a spring or a scale is bent, by its name, and by which share at the largest."""
        found = [account.bent(name) for account in self.accounts]
        # to rounding it may exceed one
        return min(sum(own for own, _ in found), 1.0), max(found)[1] if found else 0.0

    @property
    def target(self) -> Target:
        """The same posterior for the sampler, built anew: its functions could not be pickled."""
        return self.build_target()


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeDecays:
    """Many records (possibly none) of one system and sensor, and where in each the free decay lies.

    Attributes
    ----------
    values : ndarray, shape (records, n)
        Samples.
    located : Located
        From :func:`friction_bayes.decay.location.locate_free_decays`; rows where nothing was found are left
        out.
    step : float
        Sampling interval [s].
    system, quantity, unit
        What was measured, of what, and in which unit.
    dropouts : mapping of int to ndarray of int
        Samples that take the place of dropouts, by row.
    """

    values: Array
    located: Located
    step: float
    system: Oscillator
    quantity: Quantity
    unit: str
    dropouts: Mapping[int, Indices] = field(default_factory=dict)

    @property
    def usable(self) -> Mask:
        """Rows in which a free decay was found."""
        return self.located.status == FOUND

    def decay(self, row: int) -> FreeDecay:
        """The moving part of a record by itself."""
        located, start = self.located, int(self.located.start[row])
        return FreeDecay(
            name=f"record {row}",
            values=self.values[row, start : int(located.stop[row])],
            start_time=start * self.step,
            step=self.step,
            quantity=self.quantity,
            unit=self.unit,
            system=self.system,
            frequency=float(located.frequency[row]) / self.step,
            phase=float(located.phase[row]),
            rest_position=float(located.rest_position[row]),
            stops=bool(located.stops[row]),
            disturbed=int(located.disturbed[row]),
            driven=bool(located.driven[row]),
        )

    def without_dropouts(self, row: int) -> FreeDecay:
        """The moving part of a record by itself, without the samples that take the place of dropouts."""
        decay = self.decay(row)
        dropouts = self.dropouts.get(row)
        return decay if dropouts is None else decay.without_samples_at(np.asarray(self.step * dropouts))

    @property
    def counts(self) -> Integers:
        """Samples in each moving part; none in a row that is left out."""
        return np.where(self.usable, self.located.stop - self.located.start, 0)

    @property
    def kernel_arguments(self) -> tuple[Any, ...]:
        """Arguments of a half-cycle kernel: where each decay lies, and what is known of it."""
        start, phase = self.located.start, self.located.phase
        frequency = self.located.frequency / self.step
        swing = swing_frequency(self.system, self.unit)
        order = self.quantity.order
        return self.values, self.step, frequency, phase, start, start + self.counts, order, swing


class Glance(NamedTuple):
    """Certain results on the residuals of many records, shape (records,); False without a posterior.

    Attributes
    ----------
    white : ndarray of bool
        That it is white noise.
    straight : ndarray of bool
        That the amplitude does not fall faster or slower while it is larger.
    """

    white: Mask
    straight: Mask


@dataclass(frozen=True, kw_only=True, eq=False)
class Fits:
    """Results of an estimator for many free decays, in the units of the signal; nan without a result.

    Attributes
    ----------
    family : scipy.stats continuous distribution
        Of the posterior of the signal's friction coefficient.
    parameters : tuple of ndarray, shape (records,)
        Its shapes, location and scale.
    frequency, frequency_sd, rest_position, noise_sd : ndarray, shape (records,)
        As in :class:`Fit`.
    residual : callable, int -> ndarray, or None
        Residual of the moving part of a record with a posterior; None where the method predicts no signal.
    glance : callable, () -> Glance, or None
        What is sure of the residuals at a glance; None where all of them are to be looked at.
    """

    family: Any
    parameters: tuple[Array, ...]
    frequency: Array
    frequency_sd: Array
    rest_position: Array
    noise_sd: Array
    residual: Callable[[int], Array] | None = field(default=None, repr=False)
    glance: Callable[[], Glance] | None = field(default=None, repr=False)

    @property
    def found(self) -> Mask:
        """Which records have a posterior."""
        finite = [np.isfinite(parameter) for parameter in (*self.parameters, self.frequency)]
        return np.logical_and.reduce(finite)


@runtime_checkable
class Estimator(Protocol):
    """One closed-form estimator; see CONTRIBUTING for how to add one."""

    @property
    def name(self) -> str:
        """Its name in ``--method``."""
        ...

    @property
    def prior_keys(self) -> tuple[str, ...]:
        """Keys that ``--prior KEY=VALUE`` and ``prior={...}`` may set."""
        ...

    def default_prior(self, signal: DeclaredSignal) -> dict[str, float]:
        """Weak prior derived from the declared system, not from the data; keys are ``prior_keys``."""
        ...

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        """Closed-form posterior of one free decay."""
        ...

    def fit_many(self, decays: FreeDecays, prior: Mapping[str, float], *, peaks: str) -> Fits:
        """Closed-form posteriors of many free decays, equal to those of :meth:`fit` up to rounding.

        A record that :meth:`fit` would refuse has none. A prior or system with which no record can be fitted
        is refused, without records too.
        """
        ...
