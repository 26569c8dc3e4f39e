r"""One or several records under one law: own coefficients are integrated out, and the rest adds up.

Of one record without own coefficients nothing is integrated out, and its sums are those of the problem.

Given the random force a record is ``y = S b + O a + e`` with coefficients ``b`` that all records share and
``a`` of its own: its start, the effects of its sensor
(:mod:`friction_bayes.statespace.own_columns`). The sums of the records are added, and the sets are evaluated
on them as on those of one record.

One coefficient may differ between the records, about a shared mean: the deviation is one more column of each
record's own, whose prior sd is the spread between them. The spread takes a few values, zero among them; each
set is evaluated with each of these.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.statespace.force_prior import GridPoint
from friction_bayes.statespace.kalman import Whitened
from friction_bayes.statespace.own_columns import Eliminated, OwnColumns, eliminate
from friction_bayes.statespace.regression import LawRegression, likely_columns, near_least_squares
from friction_bayes.statespace.subset_evidence import (
    NestedSets,
    SetEvidences,
    bound_sets,
    evaluate_bounded,
    full_noise2,
    nest,
    set_marginals,
    set_mean,
    set_posterior,
)

__all__ = ["Conditional", "Member", "Problem", "Spread"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Member:
    """One record of a problem.

    Attributes
    ----------
    regression : LawRegression
        The record on its columns, which are the same ones for all records.
    noise : float
        Its sensor noise over the common one.
    force : float
        Its random force over the common one.
    """

    regression: LawRegression
    noise: float = 1.0
    force: float = 1.0

    def ratio(self, common: float) -> float:
        """Its random force over its noise, where that of the common ones is ``common``."""
        return common * self.force / self.noise


@dataclass(frozen=True, kw_only=True, eq=False)
class Spread:
    """The column whose coefficient may differ between the records, and its spread.

    Attributes
    ----------
    columns : ndarray of int, shape (m,)
        Which it is in each set, so that a deviation has the shape of what it deviates from; -1 for none.
    sd : ndarray, shape (k,)
        Prior sd of the deviations, in units of the column's prior sd; zero for none.
    log_prior : ndarray, shape (k,)
        Log prior probabilities of these.
    """

    columns: Integers
    sd: Array
    log_prior: Array

    @classmethod
    def none(cls, sets: int) -> Spread:
        """No column differs in any of so many sets."""
        return cls(columns=np.full(sets, -1), sd=np.zeros(1), log_prior=np.zeros(1))


class Problem:
    """A regression given the random force, of one record or several.

    Its sets contain the shared columns alone, each once for every spread that it may have.

    Parameters
    ----------
    members : sequence of Member, length r
    own : ndarray of bool, shape (p,)
        Columns whose coefficient is each record's own, and is integrated out. Their priors are normal.
    spread : Spread
    kept : ndarray of bool, shape (m,), optional
        The sets of the records that are evaluated; all by default.

    Attributes
    ----------
    shared : ndarray of int, shape (s,)
        Columns whose coefficients all records share.
    least_noise2 : float
        Least variance of the common noise.
    sets : ndarray of bool, shape (n, p)
        Shared columns in each set.
    number, spread_number : ndarray of int, shape (n,)
        Which set of the records each is, and at which spread.
    """

    def __init__(
        self, members: Sequence[Member], own: Mask, spread: Spread, kept: Mask | None = None
    ) -> None:
        first = members[0].regression
        self.own, self.spread = own, spread
        self.shared = np.flatnonzero(~own)
        self.names, self.scale, self.positive = first.names, first.scale, first.positive
        meant = ((spread.sd[:, None] == 0.0) | (spread.columns >= 0)) & (True if kept is None else kept)
        self.spread_number, self.number = np.nonzero(meant)
        self.sets = (first.sets & ~own)[self.number]
        self.log_prior = spread.log_prior[self.spread_number] + first.log_prior[self.number]
        self._own_sets, own_set = _distinct(first.sets & own)
        self._own_set = own_set[self.number]
        differs = spread.sd[self.spread_number] > 0.0
        self._deviating = np.where(differs, spread.columns[self.number], -1)
        self.members = tuple(members)
        if len(self.members) > 1:
            self.references = self._least_squares()
            self.members = tuple(
                replace(member, regression=replace(member.regression, near=reference))
                for member, reference in zip(members, self.references, strict=True)
            )
        else:
            self.references = first.reference[None]
        self.least_noise2 = max((m.regression.least_noise / m.noise) ** 2 for m in self.members)
        self._possible = np.ones(len(self.sets), np.bool_)
        self._known: dict[tuple[float, float], SetEvidences] = {}
        self._bounded: dict[tuple[float, float], list[_Part]] = {}

    @classmethod
    def of(cls, regression: LawRegression) -> Problem:
        """That of one record."""
        own = np.zeros(regression.scale.size, np.bool_)
        return cls((Member(regression=regression),), own, Spread.none(len(regression.sets)))

    def only(self, row: int, integrated: Mask | None = None) -> Problem:
        """The records on the columns of one set alone, those ``integrated``, shape (p,), integrated out."""
        inside = self.inside(row) | self.sets[row]
        members = [
            replace(member, regression=member.regression.of_columns(inside)) for member in self.members
        ]
        column, sd = self.deviation(row)
        place = int(np.count_nonzero(inside[:column])) if column >= 0 else -1
        spread = Spread(columns=np.array([place]), sd=np.array([sd]), log_prior=np.zeros(1))
        own = self.own if integrated is None else self.own | integrated
        return Problem(members, own[inside], spread)

    def of_either_sign(self) -> Problem:
        """The same, no coefficient of which has to be positive."""
        none = np.zeros_like(self.positive)
        members = [
            replace(member, regression=replace(member.regression, positive=none)) for member in self.members
        ]
        return Problem(members, self.own, self.spread)

    @cached_property
    def reference(self) -> Array:
        """Shared coefficients near the records, in units of ``scale``, shape (s,)."""
        return np.asarray(self.references[0, self.shared])

    @cached_property
    def _positive(self) -> Mask:
        """Which shared coefficients have to be positive, shape (s,)."""
        return np.asarray(self.positive[self.shared])

    @cached_property
    def used(self) -> int:
        """Samples of all records that are used."""
        return sum(int(np.count_nonzero(member.regression.clock.used)) for member in self.members)

    @property
    def log_least_variance(self) -> float:
        """Logarithm of the least variance of the noise; below every other where there is no least one."""
        return math.log(max(self.least_noise2, 1e-300))

    @property
    def noise_before(self) -> float:
        """First guess of the common noise: that of the motions along which the columns are."""
        logs = [math.log(member.regression.motion.noise / member.noise) for member in self.members]
        return math.exp(sum(logs) / len(logs))

    def log_prior_density(self, scaled: Array) -> Array:
        """Log prior density of shared coefficients (m, s) in units of ``scale``; -inf off their support."""
        scale, positive = self.scale[self.shared], self.positive[self.shared]
        normaliser = -0.5 * math.log(2.0 * math.pi) - np.log(scale) + math.log(2.0) * positive
        inside = np.all((scaled >= 0.0) | ~positive, axis=1)
        return np.where(inside, (normaliser - 0.5 * scaled**2).sum(axis=1), -np.inf)

    def marginal(self, ratio: float, tau: float) -> Whitened:
        """Whitened sums of the shared columns, the own ones of the first set integrated out."""
        return self._bounds(ratio, tau)[self._part_of_set[0]].whitened

    def without(self, sets: Mask) -> Problem:
        """The same where the ``sets``, shape (n,), do not count; the bounds of all are kept."""
        again = copy(self)
        again._possible = self._possible & ~sets
        again._known = {}
        return again

    def among(self, sets: Mask) -> Problem:
        """The same of some of its sets alone, ``sets`` of shape (n,)."""
        again = copy(self)
        for name in ("sets", "number", "spread_number", "log_prior", "_own_set", "_deviating", "_possible"):
            setattr(again, name, getattr(self, name)[sets])
        for name in ("_part_of_set", "_parts"):
            again.__dict__.pop(name, None)
        again._known, again._bounded = {}, {}
        return again

    def evaluate(self, ratio: float, tau: float) -> SetEvidences:
        """Weights of all sets given the common ``q / sigma`` and ``tau``, remembered."""
        if (ratio, tau) not in self._known:
            self._known[ratio, tau] = self._evaluated(ratio, tau)
        return self._known[ratio, tau]

    def _evaluated(self, ratio: float, tau: float) -> SetEvidences:
        parts = self._bounds(ratio, tau)
        if not self._possible.all():
            parts = [part.among(self._possible) for part in parts]
        if len(parts) == 1:
            # of all sets: their noise is kept once
            (part,) = parts
            return evaluate_bounded(part.whitened, self.reference, self._positive, part.sets, part.bounds)
        log_weight, noise2 = np.empty(len(self.sets)), np.empty(len(self.sets))
        best = -math.inf
        for part in sorted(parts, key=lambda part: -part.bounds.log_weight.max()):
            found = evaluate_bounded(
                part.whitened, self.reference, self._positive, part.sets, part.bounds, best
            )
            best = max(best, float(found.log_weight.max()))
            log_weight[part.mine], noise2[part.mine] = found.log_weight, found.noise2
        return SetEvidences(log_weight, noise2, parts[0].bounds.full_noise2)

    def _bounds(self, ratio: float, tau: float) -> list[_Part]:
        """Upper bounds of all weights, remembered, so that a set is evaluated only where it may matter."""
        if (ratio, tau) not in self._bounded:
            self._bounded[ratio, tau] = self._bound(ratio, tau)
        return self._bounded[ratio, tau]

    def _bound(self, ratio: float, tau: float) -> list[_Part]:
        grams, log_determinant, used = self._sums(ratio, tau)
        lam = self._full_noise2(grams, used)
        parts = []
        for mine, sets, nested, own, log_prior in self._parts:
            left = self._eliminated(grams, own, lam)
            whitened = Whitened(left.gram, log_determinant + left.log_determinant, used)
            bounds = bound_sets(
                whitened,
                self.reference,
                self._positive,
                sets,
                log_prior,
                least_noise2=self.least_noise2,
                lam=lam,
                nested=nested,
            )
            parts.append(_Part(mine, sets, left, whitened, bounds))
        return parts

    def marginals(self, point: GridPoint, row: int) -> tuple[Array, Array]:
        """Marginals of the shared coefficients in a set at a point of the grid, in units of ``scale``."""
        return set_marginals(
            *self.shared_posterior(point, row, self.sets[row]), self.sets[row], self.positive
        )

    def mean(self, point: GridPoint, row: int) -> Array:
        """Mean shared coefficients, shape (p,), in units of ``scale``; zero where a set has none."""
        law, shared, found = np.zeros(self.own.size), self.shared, point.found
        law[shared] = set_mean(
            self._left(point, row).gram,
            self.reference,
            self.sets[row][shared],
            self.positive[shared],
            found.full_noise2,
            float(found.noise2[row]),
        )
        return law

    def inside(self, row: int) -> Mask:
        """Own columns in a set, shape (p,)."""
        return np.asarray(self._own_sets[self._own_set[row]])

    def deviation(self, row: int) -> tuple[int, float]:
        """The column that differs between the records in a set, -1 for none, and the prior sd of that."""
        return int(self._deviating[row]), float(self.spread.sd[self.spread_number[row]])

    def conditional(self, point: GridPoint, row: int) -> Conditional:
        """The posterior of all coefficients in one set at a point of the grid."""
        mean, covariance = self.shared_posterior(point, row, self.sets[row])
        scale = self.scale[self.sets[row]]
        return Conditional(
            problem=self,
            row=row,
            mean=mean * scale,
            covariance=covariance * np.outer(scale, scale),
            noise=math.sqrt(float(point.found.noise2[row])),
            left=self._left(point, row),
        )

    def shared_posterior(self, point: GridPoint, row: int, columns: Mask) -> tuple[Array, Array]:
        """Mean and covariance of shared coefficients, in units of ``scale`` and before they are cut at zero.

        Parameters
        ----------
        point : GridPoint
        row : int
            The set whose own columns, spread and noise are taken.
        columns : ndarray of bool, shape (p,)
            The shared columns.
        """
        found = point.found
        return set_posterior(
            self._left(point, row).gram,
            self.reference,
            columns[self.shared],
            found.full_noise2,
            float(found.noise2[row]),
        )

    def _left(self, point: GridPoint, row: int) -> Eliminated:
        """Sums of the shared columns at a point, a set's own integrated out."""
        return self._bounds(point.ratio, point.tau)[self._part_of_set[row]].left

    @cached_property
    def all_shared(self) -> bool:
        """Whether no coefficient is a record's own."""
        return not self.own.any() and bool((self._deviating < 0).all())

    @cached_property
    def _part_of_set(self) -> Integers:
        """Which part each set is in, shape (n,).

        Those of a part have the same own columns, and the same column that differs by one spread.
        """
        if self.all_shared:
            return np.zeros(len(self.sets), np.intp)
        same = np.stack([self._own_set, self.spread_number, self._deviating], axis=1)
        return np.unique(same, axis=0, return_inverse=True)[1]

    @cached_property
    def _parts(self) -> list[tuple[Integers, Mask, NestedSets, OwnColumns, Array]]:
        """Of each part the places of its sets, shared columns, these nested, own ones, log priors."""
        parts = []
        for each in range(int(self._part_of_set.max()) + 1):
            mine = np.flatnonzero(self._part_of_set == each)
            sets, log_prior = np.ascontiguousarray(self.sets[mine][:, self.shared]), self.log_prior[mine]
            sets.flags.writeable = log_prior.flags.writeable = False
            parts.append((mine, sets, nest(sets), self._own_columns(int(mine[0])), log_prior))
        return parts

    def _sums(self, ratio: float, tau: float) -> tuple[Array, float, int]:
        """Sums of each record in units of the common noise, shape (r, p + 1, p + 1).

        Of all together, (1, p + 1, p + 1), where no coefficient is a record's own.
        """
        grams, log_determinant, used = [], 0.0, 0
        for member in self.members:
            record = member.regression.whiten_at(member.ratio(ratio), tau)
            grams.append(record.gram / member.noise**2)
            log_determinant += record.log_determinant + record.used * math.log(member.noise**2)
            used += record.used
        together = [sum(grams)] if self.all_shared else grams
        return np.array(together), log_determinant, used

    def _full_noise2(self, grams: Array, used: int) -> float:
        """Noise variance of least squares with all columns, and deviations where there may be any."""
        if self.all_shared:
            alike = self.members[0].regression.alike
            return max(full_noise2(Whitened(grams[0], 0.0, used + alike)), self.least_noise2)
        deviating = np.unique(self._deviating)
        own = self._columns(self.own, deviating[deviating >= 0], float(self.spread.sd.max()))
        left = eliminate(grams, own, 0.0)
        return max(full_noise2(Whitened(left.gram, 0.0, used - own.centre.size)), self.least_noise2)

    def _eliminated(self, grams: Array, own: OwnColumns, lam: float) -> Eliminated:
        """Integrate out own columns, deviations among them."""
        if self.all_shared:
            none = np.zeros((len(self.members), 0, grams.shape[2]))
            return Eliminated(grams[0], 0.0, none[:, :, :0], none)
        return eliminate(grams, own, lam)

    def _own_columns(self, row: int) -> OwnColumns:
        """Those of a set, the deviation among them; what the reference has and the set lacks goes back."""
        inside, (column, sd) = self.inside(row), self.deviation(row)
        deviating = np.array([column] if column >= 0 else [], np.intp)
        own = self._columns(inside, deviating, sd)
        return own._replace(centre=self.centre(row), back=np.where(self.own & ~inside, self.references, 0.0))

    def _columns(self, inside: Mask, deviating: Integers, deviation: float) -> OwnColumns:
        """Own columns ``inside`` and deviations of some columns, all about zero."""
        columns = np.concatenate([np.flatnonzero(inside), deviating, self.shared])
        scale = np.ones(columns.size)
        first = np.count_nonzero(inside)
        scale[first : first + deviating.size] = deviation
        centre = np.zeros((len(self.members), first + deviating.size))
        return OwnColumns(columns, scale, centre, np.zeros((len(self.members), self.own.size)))

    def centre(self, row: int) -> Array:
        """The reference of the own columns, shape (r, k); that of deviations is zero."""
        inside = self.inside(row)
        none = np.zeros((len(self.members), int(self._deviating[row] >= 0)))
        return np.hstack([self.references[:, inside], none])

    def _least_squares(self) -> Array:
        """A law near each record, of the same shared coefficients, in units of ``scale``, shape (r, p)."""
        regressions = [member.regression for member in self.members]
        grams = [each.guessed_gram / each.motion.noise**2 for each in regressions]
        first = regressions[0]
        likely = likely_columns(first.sets, first.log_prior)
        own = self.own & likely
        left = eliminate(np.array(grams), self._columns(own, np.empty(0, np.intp), 0.0), 0.0)
        together = near_least_squares(left.gram, likely[~self.own])
        references = np.zeros((len(grams), self.scale.size))
        references[:, ~self.own] = together
        references[:, own] = left.own(together[None])[:, 0]
        return references


def _distinct(rows: Any) -> tuple[Any, Integers]:
    """The different rows of an array, and which of them each row is."""
    if not rows.any():
        # sorting is slow where there are very many
        return rows[:1], np.zeros(len(rows), np.intp)
    return np.unique(rows, axis=0, return_inverse=True)


class _Part(NamedTuple):
    """Sets of the same own columns, and upper bounds of their weights at a point.

    Attributes
    ----------
    mine : ndarray of int, shape (k,)
        Their places among all sets.
    sets : ndarray of bool, shape (k, s)
        Their shared columns.
    left : Eliminated
    whitened : Whitened
        The sums of ``left``.
    bounds : SetEvidences
    """

    mine: Integers
    sets: Mask
    left: Eliminated
    whitened: Whitened
    bounds: SetEvidences

    def among(self, possible: Mask) -> _Part:
        """The same where some sets have no prior probability, ``possible`` of shape (n,)."""
        log_weight = np.where(possible[self.mine], self.bounds.log_weight, -np.inf)
        return self._replace(bounds=self.bounds._replace(log_weight=log_weight))


@dataclass(frozen=True, kw_only=True, eq=False)
class Conditional:
    """The posterior of all coefficients in one set at a point of the grid.

    Attributes
    ----------
    problem : Problem
    row : int
        The set.
    mean, covariance : ndarray, shapes (s,), (s, s)
        Of the shared coefficients in the set, natural units, before they are cut at zero.
    noise : float
        Of the sensor, the common one.
    left : Eliminated
        Sums of the shared columns.
    """

    problem: Problem
    row: int
    mean: Array
    covariance: Array
    noise: float
    left: Eliminated

    @property
    def columns(self) -> Integers:
        """Which the shared coefficients are, shape (s,)."""
        return np.flatnonzero(self.problem.sets[self.row])

    def laws(self, shared: Array, rng: np.random.Generator | None = None) -> Array:
        """Coefficients of each record, natural units, shape (n, r, p), the deviation within the column's.

        Parameters
        ----------
        shared : ndarray, shape (n, s)
            Shared coefficients in the set.
        rng : numpy.random.Generator, optional
            To draw the records' own coefficients; their means by default.
        """
        problem, columns, centre = self.problem, self.columns, self.problem.centre(self.row)
        n, records, k = len(shared), *centre.shape
        laws = np.zeros((n, records, problem.own.size))
        laws[:, :, columns] = (shared / problem.scale[columns])[:, None]
        away = laws[:, 0, problem.shared] - problem.reference
        score = None if rng is None else self.noise * rng.standard_normal((records, n, k))
        own = self.left.own(away, score).transpose(1, 0, 2) + centre
        inside = np.flatnonzero(problem.inside(self.row))
        laws[:, :, inside] = own[:, :, : inside.size]
        if k > inside.size:
            column, sd = problem.deviation(self.row)
            laws[:, :, column] += sd * own[:, :, -1]
        return laws * problem.scale
