r"""Accounts of the residual of a decay: white noise, coloured noise, a random force, both.

White noise, coloured noise, white noise with a random force and coloured noise with one are evaluated on the
same samples. Without a force the columns of the law go along the trajectory that was fitted, so that the
regression is the expansion of that very fit; with one along the motion smoothed under it, or along the
trajectory too where that explains the record better, as for a slight force. A law with other forces than dry
friction goes along its own motion; a random force in addition to these is evaluated last, where one of both
is needed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from scipy import stats
from scipy.special import expit, logsumexp, softmax

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.text import words
from friction_bayes.decay.whiteness import Whiteness, whiteness
from friction_bayes.estimators.envelope.loss_of_amplitude import UnevenLoss
from friction_bayes.estimators.noise.behind_high_passes import behind_high_passes
from friction_bayes.estimators.noise.coulomb_regression import (
    CORNER,
    LEAST_SAMPLES,
    Laid,
    PlainDecay,
    PreparedDecay,
)
from friction_bayes.estimators.noise.filter_evidence import IMPROBABLE, FoundFilters, FoundKind
from friction_bayes.estimators.noise.noise_integral import over_noise
from friction_bayes.estimators.noise.noise_level import SensorNoise, noise_floor, own_colour, sensor_noise
from friction_bayes.estimators.noise.other_forces import (
    FORCES,
    LOSSES,
    SHAPES,
    falls_faster,
    moved_shapes,
)
from friction_bayes.estimators.noise.recording_filters import (
    RecordingFilter,
    determined,
    log_prior_of_no_high_pass,
)
from friction_bayes.estimators.noise.unlisted_filter import Likeness, gains_of
from friction_bayes.estimators.posterior_part import PosteriorPart
from friction_bayes.statespace.coloured_noise import Autoregression, with_missing_drawn
from friction_bayes.statespace.force_grid import Posterior, integrate_force
from friction_bayes.statespace.kalman import shown, smooth
from friction_bayes.statespace.problem import Member, Problem, Spread
from friction_bayes.statespace.regression import LawRegression, frequency_change
from friction_bayes.statespace.sampling.law_target import law_target

__all__ = [
    "SLIGHT",
    "UNLISTED",
    "NoiseAccount",
    "NoiseAccounts",
    "most_probable",
    "needs_no_force",
    "total_probability",
]

SLIGHT = 0.01
"""Probability of an account or a part of one below which it is not sampled, named, or followed further."""
UNLISTED = "a low pass of a kind that is not listed"
"""Name of such a filter."""
_NEGLIGIBLE = 1e-6
"""Probability below which coloured noise is not evaluated further."""
_QUIETEST = 1e-3
"""Least noise of a sensor over what a fit without a force leaves: no force is as loud."""
_SHIFTS_PATH = 0.05
"""Probability of a force in white noise along the fitted trajectory above which the motion is smoothed under
it: a less probable force hardly moves the turning points. In coloured noise it may be as probable along its
own motion alone."""

_LOG_SURE = 50.0
"""Log odds that make a probability one."""
_SOME_FORCE = "another force than dry friction"
_MOST_MOTIONS = 12
"""Of a law with other forces, each along the motion under the one before."""
_SAME = 0.1
"""Log evidence by which a further one changes nothing."""


@dataclass(frozen=True, eq=False)
class NoiseAccount:
    """One explanation of the residual: a law, a kind of noise, a random force or none, and its posterior.

    That in units of the signal is computed when it is first read.

    Attributes
    ----------
    laid : Laid
    posterior : Posterior
    weaker_above : bool
        Whether white noise represents noise that is weaker far above the motion's frequency.
    unlisted : float or None
        Gain of a filter that is not listed, over that of ``filter`` which it resembles.
    probability : float
        Of this account; not a number until it is compared with all others.
    coefficient : Mixture
        Friction coefficient ``u`` of the signal.
    frequency, frequency_sd : float
        [rad/s].
    noise_sd : float
        Of a sample.
    sd, correlation_time : frozen scipy.stats distribution
        Of the random force, in the unit of ``coefficient`` and [s]; of an account with one.
    innovations : Whiteness
        Of the whitened residuals at the most probable random force.
    """

    laid: Laid = field(repr=False)
    posterior: Posterior = field(repr=False)
    weaker_above: bool = False
    unlisted: float | None = None
    probability: float = math.nan

    @property
    def log_evidence(self) -> float:
        """Of the record in the unit of its signal, up to what all accounts share."""
        clock = self.laid.regression.clock
        samples = int(np.count_nonzero(clock.used))
        log_prior = 0.0 if self.forced else math.log(self.laid.prepared.prior.none)
        value = log_prior + self.posterior.log_evidence - samples * math.log(self.laid.unit)
        colour = clock.autoregression
        return value if colour is None else value - colour.penalty

    def along(self, laid: Laid) -> NoiseAccount:
        """The same account along a path, or under another noise."""
        return _evaluated(laid, forced=self.forced)

    @property
    def forced(self) -> bool:
        """Whether there is a random force."""
        return bool(np.any(self.posterior.ratio > 0.0))

    @property
    def coloured(self) -> bool:
        """Whether the noise is coloured."""
        return self.laid.regression.clock.autoregression is not None

    @property
    def of_white_noise(self) -> bool:
        """Whether its noise is white, as near the motion's frequency as far above it."""
        return not (self.coloured or self.weaker_above)

    @property
    def free_corners(self) -> bool:
        """Whether the corners of the motion may have any shape."""
        return self.laid.has_free_corners

    @property
    def filter(self) -> RecordingFilter | None:
        """Behind which the sensor shows the motion; the coefficient is that of the motion before it."""
        return self.laid.filter

    @property
    def kind(self) -> tuple[str, bool]:
        """Of the law, and whether there is a random force."""
        return self.laid.kind, self.forced

    @cached_property
    def share_of_sets(self) -> Array:
        """Probability of each set of columns, shape (m,)."""
        return np.asarray(self.posterior.weight.sum(axis=0))

    @cached_property
    def others(self) -> dict[str, float]:
        """Probability of each other force than dry friction, by its name; empty where the law has none."""
        if not self.laid.has_other_forces:
            return {}
        return dict(zip(FORCES, (self.share_of_sets @ self.laid.acting).tolist(), strict=True))

    @property
    def sets_of_forces(self) -> list[Indices]:
        """Places of the sets of the same other forces, the most probable forces first."""
        which = np.unique(self.laid.acting, axis=0, return_inverse=True)[1].ravel()
        found = [np.flatnonzero(which == each) for each in range(which.max() + 1)]
        return sorted(found, key=lambda rows: -float(self.share_of_sets[rows].sum()))

    @property
    def fewer(self) -> float:
        """Factor on a width that does not count what the samples determine, see :func:`over_noise`."""
        if not self.others:
            return 1.0
        regression = self.laid.regression
        samples = int(np.count_nonzero(regression.clock.used))
        return math.sqrt(samples / max(samples - int(regression.sets[0].sum()), 1))

    @property
    def noise_floor(self) -> float:
        """Sd of white noise as strong as the residual near the motion's frequency."""
        regression, filter_ = self.laid.regression, self.laid.filter
        fitted = len(regression.names)
        return noise_floor(self._left, self._phase, self.laid.order, fitted, filter_)

    def noise(self, floor: float) -> SensorNoise:
        """Noise of that floor with the colour of the residual."""
        regression = self.laid.regression
        return sensor_noise(self._left, self._phase, len(regression.names), floor, even=regression.clock.even)

    @property
    def own_colour(self) -> Autoregression | None:
        """Colour of the residual; None where it is white, or the samples are uneven."""
        clock = self.laid.regression.clock
        return own_colour(self._left, self._phase, len(self.laid.regression.names)) if clock.even else None

    @property
    def _known(self) -> slice:
        return determined(self.filter, self.laid.prepared.signal.size)

    @property
    def _phase(self) -> Array:
        return self.laid.regression.clock.phase[self._known]

    @cached_property
    def _left(self) -> Array:
        """Residual of the law and the most probable force; what does not count of it is like the rest."""
        regression, force = self.laid.regression, self.posterior.best
        clock = regression.clock
        left = regression.residual(self.posterior.best_law())
        if force.ratio > 0.0:
            states, _ = smooth(left[:, None], clock, regression.row, force.ratio, force.tau)
            left = left - shown(states[:, :3, 0], regression.row)
        return with_missing_drawn(left[self._known], clock.used[self._known])

    @cached_property
    def other_loss(self) -> UnevenLoss | None:
        """What takes energy in addition to dry friction, in this account; None where nothing does."""
        share, given = self._given(LOSSES)
        if given is None:
            return None
        regression = self.laid.regression
        return UnevenLoss(
            probability=self.probability * share,
            faster=falls_faster(regression.names, given.best_law(), regression.scale),
            coefficient=self._in_unit(given.coefficient("friction")),
            losses={name: self.others[name] / share for name in LOSSES},
        )

    def bent(self, name: str) -> tuple[float, float]:
        """Probability of the account and that a spring or a scale is bent, and the share at the largest."""
        share, given = self._given((name,))
        if given is None:
            return 0.0, 0.0
        own = np.array(self.laid.regression.names) == name
        return self.probability * share, float(given.best_law()[own].sum())

    def _given(self, forces: Sequence[str]) -> tuple[float, Posterior | None]:
        """Probability that some of these forces act, and the posterior then; None where they do not."""
        if not self.others:
            return 0.0, None
        having = self.laid.acting[:, [name in forces for name in FORCES]].any(axis=1)
        share = float(self.share_of_sets[having].sum())
        if share == 0.0:
            return 0.0, None
        return share, self.posterior.among(np.broadcast_to(having, self.posterior.weight.shape))

    @property
    def gain(self) -> float:
        """Gain from the motion to the recording."""
        known = 1.0 if self.filter is None else self.filter.gain
        return known if self.unlisted is None else known * self.unlisted

    @property
    def of_known_noise(self) -> bool:
        """Whether its noise is white, or filtered white noise, and there is no force."""
        return self.plain or (not self.forced and self.unlisted is None and self.filter is not None)

    @property
    def plain(self) -> bool:
        """Whether its noise is white, corners are as the law makes them, and there is no force or filter."""
        other = self.coloured or self.weaker_above or self.free_corners or self.forced
        return not other and self.filter is None and self.unlisted is None

    @property
    def name(self) -> str:
        """In words."""
        likely = [name for name, share in self.others.items() if share > 0.5]
        return self._named(likely if likely or not self.others else [_SOME_FORCE])

    def _named(self, others: Sequence[str]) -> str:
        """The account in words, with the other forces of some of its sets."""
        named = ["coloured noise" if self.coloured else "white noise"]
        if self.weaker_above:
            named = ["noise taken to be as strong as near the motion's frequency"]
        named += ["a random force"] if self.forced else []
        named += map(words, others)
        named += ["corners of any shape"] if self.free_corners else []
        if self.unlisted is not None:
            named += [f"behind {UNLISTED}, gain {self.gain:.4g}"]
        if self.filter is not None:
            named += [f"{'behind' if self.unlisted is None else 'like'} {self.filter.name}"]
        return ", ".join(named)

    @cached_property
    def _posterior(self) -> Posterior:
        if self.others:
            # of several sets the noise is taken as found
            return self.posterior
        prior = self.laid.prepared.prior
        used = prior if self.forced else prior.without_force
        return over_noise(_apart(self.laid.regression), self.posterior, used)

    @cached_property
    def _stiffness(self) -> Mixture:
        return self._posterior.coefficient("stiffness")

    @property
    def frequency(self) -> float:
        return self.laid.frequency * frequency_change(self._stiffness.mean())

    @property
    def frequency_sd(self) -> float:
        return 0.5 * self.laid.frequency**2 / self.frequency * self._stiffness.std()

    @property
    def _unit(self) -> float:
        # c is r / m over the reference frequency squared, u is w0**q r/k at the frequency found
        unit = self.laid.frequency**2 * self.frequency ** (self.laid.prepared.decay.order - 2)
        return unit if self.unlisted is None else unit / self.unlisted

    @cached_property
    def coefficient(self) -> Mixture:
        return self._in_unit(self._posterior.coefficient("friction"))

    @cached_property
    def noise_sd(self) -> float:
        return self._posterior.noise_sd * self._noise_unit

    @property
    def _noise_unit(self) -> float:
        # of a sample, where the regression has means of blocks
        return self.laid.unit * math.sqrt(self.laid.prepared.decay.block)

    def prediction(self, fitted: Array, time: Array) -> Array:
        """Signal under the law, at the samples of one that was ``fitted``, shape (n,) both.

        It is the fitted one where the mass may stick. ``time`` is from the first sample [s].
        """
        laid, prepared = self.laid, self.laid.prepared
        regression, order = laid.regression, laid.order
        law = laid.unit * (regression.columns @ self.posterior.best_law() - regression.target)
        law += prepared.signal
        # of means of blocks the motion that was fitted, which an accelerometer does not read
        about = fitted - prepared.decay.rest_position
        own = prepared.fitted if order < 2 else np.interp(prepared.time, time, about)
        return np.asarray(fitted + np.interp(time, prepared.time, law - own, right=0.0))

    @property
    def sd(self) -> stats.distributions.rv_frozen:
        return _scaled_log_normal(self._posterior.force_sd, self._unit)

    @property
    def correlation_time(self) -> stats.distributions.rv_frozen:
        return _scaled_log_normal(self._posterior.correlation_time, 1.0 / self.laid.frequency)

    @property
    def innovations(self) -> Whiteness:
        regression, best = self.laid.regression, self.posterior.best
        innovations = regression.innovations(self.posterior.best_law(), best.ratio, best.tau)
        return whiteness(innovations[regression.clock.used])

    def parts(self, force_factor: float) -> list[PosteriorPart]:
        """The same posterior as a sampler samples it: of other forces one set for each of those that count.

        Given the factor from ``coefficient`` to force. Sets that differ in a prior sd or a shape are one, the
        most probable.
        """
        if not self.others:
            return [self._part_of(0, self.probability, self.coefficient, force_factor)]
        found: list[PosteriorPart] = []
        for rows in self.sets_of_forces:
            probability = self.probability * float(self.share_of_sets[rows].sum())
            if probability >= SLIGHT or not found:
                row = int(rows[np.argmax(self.share_of_sets[rows])])
                mine = np.zeros_like(self.posterior.weight, dtype=np.bool_)
                mine[:, row] = True
                coefficient = self.posterior.among(mine).coefficient("friction")
                found.append(self._part_of(row, probability, self._in_unit(coefficient), force_factor))
        return found

    def _part_of(
        self, row: int, probability: float, coefficient: Mixture, force_factor: float
    ) -> PosteriorPart:
        build = partial(self._target, force_factor, row)
        acting = self.laid.acting[row]
        name = self._named([name for name, acts in zip(FORCES, acting, strict=True) if acts])
        return PosteriorPart(name, probability, self.forced, coefficient, build)

    def _in_unit(self, coefficient: Mixture) -> Mixture:
        return coefficient.scaled(self._unit).widened(self.fewer)

    def _target(self, force_factor: float, row: int) -> Target:
        laid = self.laid
        problem = _apart(laid.regression.of_columns(laid.regression.sets[row]))
        names = [problem.names[j] for j in problem.shared]
        friction, stiffness = names.index("friction"), names.index("stiffness")
        unit, noise_unit, forced = self._unit, self._noise_unit, self.forced

        def natural(law: Array, noise: Array, q: Array, tau: Array) -> dict[str, Array]:
            change = np.array([frequency_change(kappa) for kappa in law[:, stiffness]])
            found = {
                "friction": force_factor * unit * law[:, friction],
                "frequency": laid.frequency * change,
                "precision": (noise_unit * noise) ** -2.0,
            }
            if forced:
                found |= {
                    "random_force_sd": force_factor * unit * q,
                    "correlation_time": tau / laid.frequency,
                }
            return found

        return law_target(
            problem,
            self.laid.prepared.prior if forced else None,
            natural=natural,
            signals=[self.laid.prepared.signal + self.laid.prepared.decay.rest_position],
            unit=laid.unit,
        )


class NoiseAccounts:
    """All accounts of a decay, evaluated when they are first asked for: filters take most of the time."""

    def __init__(self, decay: PlainDecay) -> None:
        self._decay = decay

    @cached_property
    def behind_none(self) -> tuple[NoiseAccount, ...]:
        """Those behind no filter, with their probabilities if there is none; that of white noise alone first.

        None where the decay is too short, or has no appreciable noise.
        """
        if not self._decay.usable or self._prepared.samples < LEAST_SAMPLES:
            return ()
        return self._with_both(self._unfiltered.accounts)

    @cached_property
    def all(self) -> tuple[NoiseAccount, ...]:
        """The same and those behind filters, with their probabilities."""
        if not self.behind_none:
            return ()
        white = self.behind_none[0].probability >= 1.0 - SLIGHT and self._unfiltered.coloured < SLIGHT
        # what a high pass makes of a motion passes for another motion except where that jumps
        if white and self._decay.order < 2:
            return self.behind_none
        behind = _behind(self._unfiltered)
        if not behind:
            return self.behind_none
        rest = 1.0 - total_probability(behind)
        none = [replace(each, probability=each.probability * rest) for each in self._unfiltered.accounts]
        return self._with_both([*none, *behind])

    @cached_property
    def _prepared(self) -> PreparedDecay:
        return PreparedDecay(self._decay)

    @cached_property
    def _unfiltered(self) -> _Unfiltered:
        return _behind_no_filter(self._prepared)

    def _with_both(self, found: Sequence[NoiseAccount]) -> tuple[NoiseAccount, ...]:
        """What was found, and an account of other forces with a random one where either is needed."""
        return tuple(found if self._unfiltered.explained else _with_both(found))


class _Unfiltered(NamedTuple):
    """The law along the fit, and the accounts behind no filter with their probabilities.

    ``coloured`` is the probability of coloured noise, ``log_evidence`` that of all, the noise as it is.
    """

    laid: Laid
    accounts: Sequence[NoiseAccount]
    coloured: float
    log_evidence: float

    @property
    def explained(self) -> bool:
        """Whether white noise alone explains the record, and corners as dry friction makes them.

        Then no spectrum is compared: a filter would have coloured the noise or removed the corners.
        """
        if self.coloured >= SLIGHT:
            return False
        law, any_shape = (
            total_probability(
                each
                for each in self.accounts
                if each.of_white_noise and not each.forced and each.free_corners == free
            )
            for free in (False, True)
        )
        return (law + any_shape if law >= any_shape else law) >= 1.0 - SLIGHT


def _behind_no_filter(prepared: PreparedDecay) -> _Unfiltered:
    """The accounts behind no filter."""
    fit = prepared.along_fit()
    shapes = _under_white_noise(fit)
    if _of_force(shapes) > _SHIFTS_PATH:
        smoothed = prepared.along_smoothed()
        # evidences compare where they are of the same samples
        variance = np.maximum(fit.regression.clock.variance, smoothed.regression.clock.variance)
        if np.any(variance > fit.regression.clock.variance):
            fit = fit.with_variance(variance)
            shapes = _under_white_noise(fit)
        shapes = _along_too(shapes, smoothed.with_variance(variance))
    alone = shapes[0].still.log_evidence
    shapes = [
        # where it is improbable next to dry friction alone, its motion is that
        _along_own_motion(shape)
        if shape.still.laid.has_other_forces and shape.still.log_evidence > alone + math.log(SLIGHT)
        else shape
        for shape in shapes
    ]
    return _Unfiltered(fit, *_evaluate(shapes))


def needs_no_force(decay: PlainDecay) -> bool:
    """Whether a force along its fit is less probable than none, the noise being white."""
    prepared = PreparedDecay(decay)
    return _of_force(_under_white_noise(prepared.along_fit())) < 0.5


_InEvidence = tuple[NoiseAccount, float]
"""An account and its log evidence among those behind filters."""


class _Shape(NamedTuple):
    """A law along several paths, and its accounts under white noise: without a force, and with one."""

    paths: Sequence[Laid]
    still: NoiseAccount
    forced: NoiseAccount | None = None


def _of_force(shapes: Sequence[_Shape]) -> float:
    """Probability of a force if the noise is white."""
    none = logsumexp([shape.still.log_evidence for shape in shapes])
    force = logsumexp([shape.forced.log_evidence for shape in shapes if shape.forced is not None])
    return float(expit(force - none))


def _behind(unfiltered: _Unfiltered) -> list[NoiseAccount]:
    """Accounts behind filters, with their probabilities: high passes, and those that the spectra show.

    The spectra compare filters above the motion's frequency, all along one motion, and a record is no
    evidence twice. Near that frequency, where a force explains whatever a filter leaves, the odds against a
    force compare them, each kind along its own motion. Spectra include no force behind a filter: with one, a
    listed filter is identified as far as there may be none, and what is left is for one that is not listed.
    """
    laid, high_passes = unfiltered.laid, _high_passes(unfiltered)
    behind = {kind.name: each for kind, each in high_passes}
    filters = FoundFilters().and_also([kind for kind, _ in high_passes])
    if not unfiltered.explained and filters.probability < 0.5:
        # along a law that is not behind a high pass, spectra show what that makes of corners
        filters = laid.filters_along().and_also(filters.kinds)
    free = _behind_unlisted(filters, unfiltered.accounts)
    found, log_none = list(free), _log_evidence_of_filters(free)
    likely = {each.name for _, each in filters.likely}
    for kind in filters.kinds:
        if kind.log_evidence < filters.log_other + math.log(SLIGHT):
            break
        sizes = sum(each.name in likely for _, each in kind.filters)
        # an unlikely one has to leave no force where likely ones leave one
        if sizes == 0 and max(kind.log_evidence, kind.log_unlisted) < log_none:
            continue
        in_time = behind.get(kind.name)
        each = in_time or laid.behind_kind(kind)[: sizes or None]
        found += _behind_kind(each, kind, by_spectra=in_time is None)
        log_none = _log_evidence_of_filters(found)
    if not found:
        return []
    shares = filters.probability * softmax([value for _, value in found])
    # one that is listed explains the record without a force; one that is not may do so with one
    of_filter = np.array([each.unlisted is not None or not each.forced for each, _ in found])
    shares[~of_filter] *= shares[of_filter].sum()
    if free:
        rest = filters.probability - shares.sum()
        shares[: len(free)] += rest * softmax([value for _, value in free])
    return [replace(each, probability=share) for (each, _), share in zip(found, shares.tolist(), strict=True)]


def _high_passes(unfiltered: _Unfiltered) -> list[tuple[FoundKind, list[tuple[float, Laid]]]]:
    """Kinds of high passes, and the law behind the likely corners of each with their shares.

    White noise is as white behind one, so that both compare on the same samples, with a force or without:
    with all that goes behind no filter.
    """
    kinds = list(behind_high_passes(unfiltered.laid))
    if not kinds:
        return []
    white = [each for each in unfiltered.accounts if each.of_white_noise]
    laws = [*(each.laid for each in white), *(each for _, corners in kinds for _, each in corners)]
    same = np.maximum.reduce([each.regression.clock.variance for each in laws])
    white = [each.along(each.laid.with_variance(same)) for each in white]
    coloured = _coloured_as_found(_best(white), [_best(white).laid])
    none = logsumexp([each.log_evidence for each in (*white, *coloured)])
    none += log_prior_of_no_high_pass(unfiltered.laid.order)
    found = []
    for name, corners in kinds:
        # corners differ little: where the likeliest is too improbable, it stands for all
        values: list[float] = []
        for filter_, each in corners:
            values.append(filter_.log_prior + _log_evidence(each.with_variance(same)) - none)
            if values[0] + math.log(len(corners)) < math.log(IMPROBABLE):
                break
        corners = corners[: len(values)]
        filters = zip(values, (filter_ for filter_, _ in corners), strict=True)
        shares = zip(softmax(values).tolist(), (each for _, each in corners), strict=True)
        kind = FoundKind(name, sorted(filters, key=itemgetter(0), reverse=True))
        found.append((kind, [(share, each) for share, each in shares if share > SLIGHT]))
    return found


def _log_evidence(laid: Laid) -> float:
    """Of a law without a random force, alone or with other forces."""
    return float(logsumexp([_evaluated(each).log_evidence for each in (laid, _with_other_forces(laid))]))


def _with_both(found: Sequence[NoiseAccount]) -> list[NoiseAccount]:
    """The accounts, and one with other forces and a random one, with their probabilities.

    By the odds of both against one of the two, the more probable one, in its most probable account, which
    represents all of them; where neither is rather needed, both are not.
    """
    forced = [each for each in found if each.forced]
    others = [each for each in found if each.laid.has_other_forces]
    base = max(forced, others, key=total_probability)
    if total_probability(base) < 0.5:
        return list(found)
    best = most_probable(base)
    had = best.laid.has_other_forces
    laid = best.laid if had else _with_other_forces(best.laid)
    columns, alone = laid.regression.sets.sum(axis=1), laid.acting.sum(axis=1) == 1
    simplest = alone & (columns == columns.min())
    laid = laid.of_sets(simplest | (best.share_of_sets > SLIGHT) if had else simplest)
    both = _with_force([laid])
    log_odds = both.log_evidence - best.log_evidence
    value = total_probability(base) * math.exp(min(log_odds, _LOG_SURE))
    total = 1.0 + value
    return [
        *(replace(each, probability=each.probability / total) for each in found),
        replace(both, unlisted=best.unlisted, probability=value / total),
    ]


def total_probability(accounts: Iterable[NoiseAccount]) -> float:
    """Probability of any of some accounts."""
    return sum(each.probability for each in accounts)


def most_probable(accounts: Iterable[NoiseAccount]) -> NoiseAccount:
    """The most probable of some accounts."""
    return max(accounts, key=lambda account: account.probability)


def _log_evidence_of_filters(found: Sequence[_InEvidence]) -> float:
    """Log evidence of filters without a force."""
    return float(np.logaddexp.reduce([-math.inf, *(value for each, value in found if not each.forced)]))


def _behind_kind(
    behind: Sequence[tuple[float, Laid]], kind: FoundKind, *, by_spectra: bool
) -> list[_InEvidence]:
    """Accounts ``behind`` the most probable filters of a kind, with their shares, and others like the first.

    The odds against a force count where the kind is known ``by_spectra``, not by the whole record.
    Where a force is improbable behind one, it is not evaluated behind the less probable ones, which differ
    little: the odds are the same, and its accounts there stand for all of these.
    """
    shapes = [
        [_Shape([law], _evaluated(law)) for law in (each, _with_other_forces(each))] for _, each in behind
    ]
    # one sensor has one, and its estimate varies more than filters of a kind differ
    floor = float(np.median([min(shape.still.noise_floor for shape in each) for each in shapes]))
    found: list[_InEvidence] = []
    log_odds, left = None, sum(share for share, _ in behind)
    for (share, _), each in zip(behind, shapes, strict=True):
        parts = _all_at_floor(each, floor, forces=log_odds is None)
        log_none = logsumexp([part.log_evidence for part in parts if not part.forced])
        of_force = share
        if log_odds is None:
            odds = logsumexp([part.log_evidence for part in parts if part.forced]) - log_none
            if odds < math.log(SLIGHT):
                log_odds, of_force = odds, left
        else:
            odds = log_odds
        left -= share
        log_kind = kind.log_evidence - log_none - (odds if by_spectra else 0.0)
        listed = [
            (part, log_kind + math.log(of_force if part.forced else share) + part.log_evidence)
            for part in parts
        ]
        filter_ = each[0].still.laid.filter
        if not found and kind.unlisted and filter_ is not None:
            found += _with_gains(listed, kind.unlisted, filter_.gain, kind.log_evidence + math.log(share))
        found += listed
    return found


def _behind_unlisted(filters: FoundFilters, evaluated: Sequence[NoiseAccount]) -> list[_InEvidence]:
    """Accounts behind a filter that is unlike those listed.

    It has made noise and corners what they are, and no more than its gain is known.
    """
    parts = [
        (each, math.log(each.probability))
        for each in evaluated
        if each.probability and not each.of_white_noise
    ]
    unlike = [kind.unlisted[-1] for kind in filters.kinds if kind.unlisted]
    if not parts or not unlike:
        return []
    return _with_gains(parts, unlike, 1.0, float(logsumexp([value for _, value in parts])))


def _with_gains(
    found: Sequence[_InEvidence], unlisted: Sequence[Likeness], known: float, log_known: float
) -> list[_InEvidence]:
    """The same accounts behind filters that are not listed, in place of one of a known gain and evidence."""
    log_all = float(logsumexp([each.log_evidence for each in unlisted])) - log_known
    return [
        (replace(each, unlisted=gain / known), value + log_all + math.log(share))
        for each, value in found
        for share, gain in gains_of(unlisted)
    ]


def _shapes(laid: Laid) -> list[Laid]:
    """The law along a path with corners as dry friction makes them, with those of any shape, other forces."""
    free = laid.with_free_corners()
    return [laid, *([free] if free.has_free_corners else []), _with_other_forces(laid)]


def _with_other_forces(laid: Laid, shapes: tuple[float, ...] = SHAPES) -> Laid:
    """The law with one other force at least than dry friction."""
    return laid.with_other_forces(shapes, at_least_one=True)


def _under_white_noise(fit: Laid) -> list[_Shape]:
    """Accounts of white noise as it is along the fit, without a force and with one."""
    found = [_Shape([laid], _evaluated(laid)) for laid in _shapes(fit)]
    return [
        shape._replace(forced=_with_force(_paths_with_least_noise(shape))) if likely else shape
        for shape, likely in zip(found, _may_be_forced([shape.still for shape in found]), strict=True)
    ]


def _along_too(shapes: Sequence[_Shape], laid: Laid) -> list[_Shape]:
    """The same accounts along another path too: with a random force, and with other forces.

    Those of dry friction alone are what they were along the fit.
    """
    found = []
    others = {each.kind: each for each in _shapes(laid)}
    for shape in shapes:
        other = others.get(shape.still.laid.kind)
        if other is None:
            found.append(shape)
            continue
        still, forced = shape.still, shape.forced
        if still.laid.has_other_forces:
            still = _best([still, still.along(other)])
        if forced is not None:
            there = _with_force(_paths_with_least_noise(shape._replace(paths=[other])))
            forced = _best([forced, there])
        found.append(_Shape([*shape.paths, other], still, forced))
    return found


def _along_own_motion(shape: _Shape) -> _Shape:
    """The account of a law along the motion under that law, until this stays, on the same samples.

    Forces that are taken as given along one motion overshoot in the next: each is halfway. Where the motions
    settle the last one counts, though one before it may be more probable: that is not the motion of its law.
    """
    best = latest = shape.still
    shapes, variance = SHAPES, best.laid.regression.clock.variance
    for _ in range(_MOST_MOTIONS):
        before, law = latest, latest.posterior.best_law()
        shapes = moved_shapes(law[before.laid.of_other_forces], shapes)
        path = before.laid.along_law(law, 0.5).with_variance(variance)
        latest = before.along(_with_other_forces(path, shapes))
        if abs(latest.log_evidence - before.log_evidence) < _SAME:
            best = latest
            break
        best = _best([best, latest])
    return _Shape([*shape.paths, best.laid], best)


def _paths_with_least_noise(shape: _Shape) -> list[Laid]:
    """The paths under the least noise that a sensor may have."""
    return [laid.with_noise(_QUIETEST * shape.still.posterior.noise_sd) for laid in shape.paths]


def _evaluate(shapes: Sequence[_Shape]) -> tuple[list[NoiseAccount], float, float]:
    """All accounts with their probabilities, that of coloured noise as it is, and their log evidence.

    Kinds of noise compare as they are. White noise, alone or with a force, counts as it is; where the noise
    is coloured, all accounts are evaluated under a floor.
    """
    white = [shape.still for shape in shapes]
    coloured = [each for shape in shapes for each in _coloured_as_found(shape.still, [shape.still.laid])]
    best = max(part.log_evidence for part in (*white, *coloured))
    for shape in shapes:
        if shape.forced is not None:
            white.append(shape.forced)
            if shape.forced.log_evidence > best + math.log(SLIGHT):
                coloured += _coloured_as_found(shape.forced, _paths_with_least_noise(shape))
    shares = _probabilities([*white, *coloured])
    found = [replace(each, probability=share) for each, share in zip(white, shares, strict=False)]
    if (share := sum(shares[len(white) :])) > _NEGLIGIBLE:
        # the least that a shape leaves near the motion
        parts = _all_at_floor(shapes, min(shape.still.noise_floor for shape in shapes))
        for part, own in zip(parts, _probabilities(parts), strict=True):
            same = [k for k, each in enumerate(white) if part.of_white_noise and each.kind == part.kind]
            if same:
                # under the floor white noise is what it was
                before = found[same[0]]
                found[same[0]] = replace(before, probability=before.probability + share * own)
            else:
                found.append(replace(part, probability=share * own))
    return found, share, float(logsumexp([part.log_evidence for part in (*white, *coloured)]))


def _probabilities(parts: Sequence[NoiseAccount]) -> list[float]:
    return list(softmax([part.log_evidence for part in parts]).tolist())


def _may_be_forced(parts: Sequence[NoiseAccount]) -> list[bool]:
    """Which are not improbable next to the best of dry friction: with other forces there is no random one."""
    least = max(part.log_evidence for part in parts if not part.others) + math.log(SLIGHT)
    return [not part.others and part.log_evidence > least for part in parts]


def _with_force(paths: Sequence[Laid]) -> NoiseAccount:
    """The account of a shape with a force, along any path."""
    return _best([_evaluated(laid, forced=True) for laid in paths])


def _coloured_as_found(white: NoiseAccount, paths: Sequence[Laid]) -> list[NoiseAccount]:
    """The same account with the colour of its residual, along any path; none where that is white."""
    colour = white.own_colour
    return [] if colour is None else [_best([white.along(laid.with_noise(0.0, colour)) for laid in paths])]


def _all_at_floor(shapes: Sequence[_Shape], floor: float, *, forces: bool = True) -> list[NoiseAccount]:
    """All accounts, or those without a force, the noise nowhere below a floor.

    The silence behind a filter is no evidence against friction, or for a force in place of the noise.
    """
    stills = []
    for still in (shape.still for shape in shapes):
        stills.append(
            _white_or_coloured_at_floor(still.along(still.laid.with_noise(floor)), [still.laid], floor)
        )
    likely = _may_be_forced([_best(still) for still in stills])
    parts = []
    for shape, own, may_be in zip(shapes, stills, likely, strict=True):
        forced: list[NoiseAccount] = []
        if may_be and forces:
            force = _with_force([laid.with_noise(floor) for laid in shape.paths])
            forced = _white_or_coloured_at_floor(force, shape.paths, floor)
        parts += [*_stills_in_best_colour(own, forced), *forced]
    return parts


def _stills_in_best_colour(
    still: Sequence[NoiseAccount], forced: Sequence[NoiseAccount]
) -> list[NoiseAccount]:
    """Accounts without a force, the coloured one in that of an account with one where this fits better.

    What a force has explained is missing from its colour, which may be the noise's own.
    """
    white, own = still[0], list(still[1:])
    for part in forced[1:]:
        noise = part.laid.regression
        own.append(white.along(white.laid.with_noise(noise.least_noise, noise.clock.autoregression)))
    return [white, _best(own)] if own else [white]


def _white_or_coloured_at_floor(
    white: NoiseAccount, paths: Sequence[Laid], floor: float
) -> list[NoiseAccount]:
    """Accounts of noise nowhere below a floor: white, and coloured where that is worth its coefficients."""
    noise = white.noise(floor)
    parts = [replace(white, weaker_above=noise.weaker_above)]
    if noise.colour is not None:
        coloured = [white.along(laid.with_noise(noise.coloured_floor, noise.colour)) for laid in paths]
        parts.append(_best(coloured))
    return parts


def _evaluated(laid: Laid, *, forced: bool = False) -> NoiseAccount:
    """A regression without a random force, or given that there is one."""
    prior = laid.prepared.prior
    posterior = integrate_force(Problem.of(laid.regression), prior if forced else prior.without_force)
    if forced:
        posterior = posterior.among((posterior.ratio > 0.0)[:, None])
    return NoiseAccount(laid, posterior)


def _apart(regression: LawRegression) -> Problem:
    """A regression with the corners integrated out, their prior in units of the noise."""
    corners = np.array([name.startswith(CORNER) for name in regression.names])
    return Problem([Member(regression=regression)], corners, Spread.none(len(regression.sets)))


def _best(parts: Sequence[NoiseAccount]) -> NoiseAccount:
    """Of several linearisations of one account the one that explains the record best."""
    return max(parts, key=lambda part: part.log_evidence)


def _scaled_log_normal(distribution: Any, factor: float) -> Any:
    return stats.lognorm(*distribution.args, scale=distribution.kwds["scale"] * factor)
