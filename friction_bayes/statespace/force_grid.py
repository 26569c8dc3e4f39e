r"""Average over the size and the correlation time of the random force, and over all sets of columns.

The posterior of a coefficient is a mixture over the points of a grid in ``(q, tau)``, no force among them,
and over all sets of columns; every part is a normal, free or cut at zero, and sets without the coefficient
put an atom at zero.

The prior of :class:`friction_bayes.statespace.force_prior.ForcePrior` is one of ``log q`` and ``log tau``.
The grid lives in ``l = log tau`` and ``u = log(q g(tau) / sigma)`` with ``g(tau)**2 = 2 tau / (1 + tau**2)``,
the spectral density of the force at resonance, which is what a record determines; the Jacobian is one.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from friction_bayes.conjugate.mixture import OMITTED, Mixture
from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.core.errors import InputError
from friction_bayes.statespace.force_prior import ForcePrior, GridPoint, at_resonance
from friction_bayes.statespace.problem import Problem

__all__ = ["Posterior", "humps", "integrate_force", "valleys"]

_REACH = (0.003, 30.0)
"""Sizes of the force, over the prior's median, between which its modes are sought."""
_STRIPS = 7
"""Equal strips of ``log tau`` whose middles show how many modes there are."""
_SIZE_STEPS = (0.75, 0.25)
"""Of ``u``, of the search for the best size at one correlation time: at first, and from the next strip's."""
_MODE_STEPS = (0.2, 0.3)
"""Of the search for a mode, where it is known to a strip."""
_STENCIL = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1.0, 1.0]])
"""Places, in such steps, through which one quadratic leads."""
_LONGEST_STEP, _MOST_STEPS = 4.0, 6
"""Of Newton's method, in such steps."""
_SAME = 0.05
"""Nats by which a further step no longer matters."""
_LIKELY = 0.99
"""Probability of the sets that are evaluated on the way to a mode: the log density is known to 0.01 so."""
_CELL = 1.5
"""Side of a grid cell in posterior standard deviations: of a normal density their sum is right to 2e-4."""
_DEPTH = 3.5
"""Nats below the best cell of a mode at which the neighbours of a cell are not looked at.

Modes count as two where the way between them leads through half as many below the better one, so that no
cell there is looked at by chance; one that lies twice as many below the best is left out.
"""
_MOST_CELLS = 80
_OUTSIDE = 1e10
_ROUNDING = 1e-9
"""Of ``log tau``, by which places lie within the bounds of the prior."""
_SUBCELLS = np.stack(np.meshgrid(*2 * [np.linspace(-0.5, 0.5, 17)[1::2]]), axis=-1).reshape(-1, 2)
"""Points of a cell, in its sides, that show how much of it lies within the prior."""


class Posterior:
    """Probabilities of sets, of columns and of a random force, and marginals of the coefficients.

    Parameters
    ----------
    problem : Problem
        The regression.
    points : sequence of GridPoint, length g
        Where it has been evaluated.

    Attributes
    ----------
    log_evidence : float
        ``log p(y)``, up to what all models of one record share.
    weight : ndarray, shape (g, m)
        Posterior probability of each point and set.
    ratio, tau, noise : ndarray, shape (g,)
        Of the points, see :class:`friction_bayes.statespace.force_prior.GridPoint`.
    """

    def __init__(self, problem: Problem, points: list[GridPoint]) -> None:
        self.problem, self.points = problem, points
        joint = np.array([point.found.log_weight + point.log_volume for point in points])
        highest = float(joint.max())
        weight = np.exp(joint - highest)
        total = float(weight.sum())
        self.log_evidence = highest + math.log(total)
        self.weight = weight / total
        self.ratio = np.array([point.ratio for point in points])
        self.tau = np.array([point.tau for point in points])
        self.noise = np.array([point.noise for point in points])
        self._marginals: dict[tuple[int, int], tuple[Array, Array]] = {}

    @property
    def probability(self) -> float:
        """Probability that there is a random force."""
        return float(self._share[self.ratio > 0.0].sum())

    def coefficient(self, name: str) -> Mixture:
        """Marginal of a coefficient in natural units."""
        j = self.problem.names.index(name)
        positive = bool(self.problem.positive[j])
        weight = self.weight / self.weight.sum()
        inside = np.tile(self.problem.sets[:, j], (len(self.points), 1))
        atom = float(weight[~inside].sum())
        use = inside & (weight > OMITTED)
        kept = weight[use]
        marginals = [self._marginals_at(g, m) for g, m in np.argwhere(use).tolist()]
        location = np.array([location[j] for location, _ in marginals])
        scale2 = np.array([scale2[j] for _, scale2 in marginals])
        if kept.size == 0:
            atom = 1.0
        else:
            kept = kept * ((1.0 - atom) / kept.sum())
        scale = self.problem.scale[j]
        return Mixture.of_normals(
            kept, location * scale, np.sqrt(scale2) * scale, positive=positive, atom=atom
        )

    def _marginals_at(self, g: int, m: int) -> tuple[Array, Array]:
        """Those of all coefficients of a set at a point, remembered: each coefficient looks at them."""
        if (g, m) not in self._marginals:
            self._marginals[g, m] = self.problem.marginals(self.points[g], m)
        return self._marginals[g, m]

    @cached_property
    def _share(self) -> Array:
        """Posterior probability of each point, shape (g,)."""
        return np.asarray(self.weight.sum(axis=1))

    def among(self, cells: Mask) -> Posterior:
        """The same given that the truth is at some of the points and sets, ``cells`` of shape (g, m)."""
        points = [
            replace(
                point, found=point.found._replace(log_weight=np.where(mine, point.found.log_weight, -np.inf))
            )
            for point, mine in zip(self.points, cells, strict=True)
            if mine.any()
        ]
        return Posterior(self.problem, points)

    @property
    def force_sd(self) -> Any:
        """Posterior of ``q``, the sd of the random force, given that there is one: a frozen log-normal.

        Its moments in the logarithm are those over the grid.
        """
        return self._log_normal(self.ratio * self.noise)

    @property
    def correlation_time(self) -> Any:
        """Posterior of ``tau``, a phase, given that there is a random force: a frozen log-normal."""
        return self._log_normal(self.tau)

    @property
    def noise_sd(self) -> float:
        """Posterior mean of the sensor noise sd."""
        return float(self._share @ self.noise)

    @property
    def best(self) -> GridPoint:
        """The point with the most probable set."""
        return self.points[int(np.argmax(self.weight.max(axis=1)))]

    @property
    def best_force(self) -> GridPoint | None:
        """The most probable point with a random force; None where none has been looked at."""
        forced = np.flatnonzero(self.ratio > 0.0)
        return self.points[forced[np.argmax(self._share[forced])]] if forced.size else None

    def best_law(self) -> Array:
        """Mean coefficients, shape (p,), of the best set at the best point; zero where absent."""
        return self.mean_law(self.best, self.best.row)

    def mean_law(self, point: GridPoint, row: int) -> Array:
        """Mean coefficients, shape (p,), of a set at a point; zero where absent."""
        return self.problem.mean(point, row) * self.problem.scale

    def _log_normal(self, values: Array) -> Any:
        use = (self.ratio > 0.0) & (self._share > 0.0)
        if not use.any():
            raise InputError("random force", "none has been looked at", "give a prior that allows one")
        weight, log_value = self._share[use] / self._share[use].sum(), np.log(values[use])
        mean = float(weight @ log_value)
        sd = math.sqrt(float(weight @ (log_value - mean) ** 2))
        return stats.lognorm(max(sd, 1e-9), scale=math.exp(mean))


def integrate_force(
    problem: Problem,
    prior: ForcePrior,
    *,
    near: GridPoint | None = None,
    only_mode: bool = False,
) -> Posterior:
    """Posterior evaluated where it has mass: without a force, and with one on cells grown from its modes.

    Neighbours of every cell near the best are looked at in turn, so that ridges and edges are followed. Modes
    share the correlation times among them: cells of one reach to the lowest place on the way to the next.

    Parameters
    ----------
    problem : Problem
        The regression.
    prior : ForcePrior
        Of the random force.
    near : GridPoint, optional
        Where the mode of much the same problem was: where the mode will do it is climbed from at once.
    only_mode : bool
        Whether the best mode will do for the part with a force: enough to smooth with, not to average.
    """
    points = [
        GridPoint(ratio=0.0, tau=1.0, log_volume=math.log(prior.none), found=problem.evaluate(0.0, 1.0)),
    ]
    if prior.none >= 1.0:
        return Posterior(problem, points)
    density = _Density(problem, prior)
    if only_mode and near is not None:
        start = density.place(near)
        top = _climb(density, start, math.log(prior.tau_low), math.log(prior.tau_high))
        return Posterior(problem, [*points, density.point(top, 0.0)])
    modes = _modes(density)
    if only_mode:
        return Posterior(problem, [*points, density.point(modes[0].place, 0.0)])
    for mode in modes:
        points += _cells(density, mode)
    return Posterior(problem, points)


class _Density:
    """Log posterior of ``(u, log tau)``, and its values so far; ``q`` follows from the noise found there."""

    def __init__(self, problem: Problem, prior: ForcePrior) -> None:
        self.problem, self.prior = problem, prior
        self.known: dict[tuple[float, ...], float] = {}

    def __call__(self, place: Array) -> float:
        if not self.prior.tau_low <= self.force(place)[1] <= self.prior.tau_high:
            return -_OUTSIDE
        key = tuple(place)
        if key not in self.known:
            point = self.point(place, 0.0)
            self.known[key] = point.found.log_total + point.log_volume
        return self.known[key]

    def of_likely_sets(self, place: Array) -> _Density:
        """The same of the sets that are probable at a place alone."""
        if len(self.problem.sets) == 1:
            return self
        found = self.problem.evaluate(*self.force(place))
        return _Density(self.problem.among(found.holding(_LIKELY)), self.prior)

    def place(self, force: GridPoint) -> Array:
        """Place of a force, its correlation time moved within the bounds of the prior."""
        low, high = math.log(self.prior.tau_low) + _ROUNDING, math.log(self.prior.tau_high) - _ROUNDING
        log_tau = min(max(math.log(force.tau), low), high)
        return np.array([math.log(force.ratio * at_resonance(math.exp(log_tau))), log_tau])

    def force(self, place: Array) -> tuple[float, float]:
        tau = math.exp(place[1])
        return math.exp(place[0]) / at_resonance(tau), tau

    def point(self, place: Array, log_cell: float) -> GridPoint:
        """Grid point of a place: the problem remembers what was evaluated there."""
        ratio, tau = self.force(place)
        found = self.problem.evaluate(ratio, tau)
        noise = math.sqrt(found.noise2[found.log_weight.argmax()])
        log_prior = self.prior.log_density(ratio * noise, tau)
        return GridPoint(ratio=ratio, tau=tau, log_volume=log_cell + log_prior, found=found)


class _Mode(NamedTuple):
    """A mode, and the bounds of ``log tau`` between which its cells lie."""

    place: Array
    low: float
    high: float


def _modes(density: _Density) -> list[_Mode]:
    """Modes that count, the best first: climbed to within each stretch of correlation times that has one."""
    crest = _crest(density)
    prior = density.prior
    bounds = [math.log(prior.tau_low), *crest[valleys(crest[:, 2]), 1], math.log(prior.tau_high)]
    stretches = list(pairwise(bounds))
    within = [crest[(crest[:, 1] >= low) & (crest[:, 1] <= high)] for low, high in stretches]
    tops = [rows[rows[:, 2].argmax()] for rows in within]
    found = [
        _Mode(_climb(density, top[:2], low, high), low, high)
        for top, (low, high) in zip(tops, stretches, strict=True)
        if top[2] > crest[:, 2].max() - 2.0 * _DEPTH
    ]
    found.sort(key=lambda mode: -density(mode.place))
    best = density(found[0].place)
    return [mode for mode in found if density(mode.place) > best - 2.0 * _DEPTH]


def _crest(density: _Density) -> Array:
    """Best sizes in the middle of each strip of correlation times: ``u``, ``log tau``, log density, in rows.

    From the best of some sizes at one correlation time, strip by strip outward.
    """
    prior = density.prior
    edges = np.linspace(math.log(prior.tau_low), math.log(prior.tau_high), _STRIPS + 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    first = _STRIPS // 2
    noise = density.problem.noise_before
    low, high = (math.log(share * prior.centre / noise) for share in _REACH)
    log_sizes = np.linspace(low, high, 7)[1:-1] + math.log(at_resonance(math.exp(middles[first])))
    start = max((np.array([size, middles[first]]) for size in log_sizes), key=density)
    size, few = start[0], density.of_likely_sets(start)
    for step in _SIZE_STEPS:
        size, height = _best_size(few, size, middles[first], step)
    rows = {first: (size, middles[first], height)}
    for strips in (range(first + 1, _STRIPS), range(first - 1, -1, -1)):
        size, growth = rows[first][0], 0.0
        for k in strips:
            before, size = size, size + growth
            few = density.of_likely_sets(np.array([size, middles[k]]))
            size, height = _best_size(few, size, middles[k], _SIZE_STEPS[-1])
            # the ridge is nearly straight
            growth = size - before
            rows[k] = (size, middles[k], height)
    return np.array([rows[k] for k in range(_STRIPS)])


def _best_size(density: _Density, size: float, log_tau: float, step: float) -> tuple[float, float]:
    """Best ``u`` at a correlation time, and its log density: the top of a parabola through three steps."""

    def at(k: int) -> float:
        return density(np.array([size + k * step, log_tau]))

    k = 0
    while abs(k) < _MOST_CELLS and (higher := max((k - 1, k, k + 1), key=at)) != k:
        k = higher
    below, value, above = at(k - 1), at(k), at(k + 1)
    bend, lead = below - 2.0 * value + above, 0.5 * (below - above)
    over = lead / bend if bend < 0.0 else 0.0
    return size + (k + over) * step, value - 0.5 * lead * over


def valleys(heights: Array) -> list[int]:
    """Indices of the lowest places between modes, see :data:`_DEPTH`."""
    lowest = [left + int(np.argmin(heights[left:right])) for left, right in pairwise(humps(heights).tolist())]
    return [k for k in lowest if heights[k] < heights.max() - 0.5 * _DEPTH]


def humps(heights: Array) -> Indices:
    """Indices of the places that are higher than their neighbours, of equal ones the first."""
    padded = np.pad(heights, 1, constant_values=-math.inf)
    return np.flatnonzero((heights > padded[:-2]) & (heights >= padded[2:]))


def _climb(density: _Density, start: Array, low: float, high: float) -> Array:
    """The best place with ``log tau`` between these bounds, by Newton's steps from one.

    A step leads to the top of the quadratic through a stencil, or else to the best place of this.
    """
    few = density.of_likely_sets(start)

    def best() -> Array:
        inside = (key for key in few.known if low <= key[1] <= high)
        return np.array(max(inside, key=lambda key: few.known[key]))

    few(start)
    size_step, tau_step = _MODE_STEPS
    first, last = low + _ROUNDING, high - _ROUNDING
    for _ in range(_MOST_STEPS):
        before = best()
        reach = min(tau_step, 0.5 * (last - first))
        centre = np.array([before[0], min(max(before[1], first + reach), last - reach)])
        values = np.array([few(centre + step * np.array([size_step, reach])) for step in _STENCIL])
        size, tau = _top(values, (first - centre[1]) / reach, (last - centre[1]) / reach)
        few(centre + np.array([size * size_step, tau * reach]))
        if few(best()) < few(before) + _SAME:
            break
    return best()


def _top(values: Array, low: float, high: float) -> tuple[float, float]:
    """Top of the quadratic through the values on the stencil, in its steps, the second within these bounds.

    Where it has none, as far in the direction in which it rises as a step may lead.
    """
    middle, right, left, up, down, corner = values
    slope, rise = 0.5 * (right - left), 0.5 * (up - down)
    bend, mixed = right + left - 2.0 * middle, corner - right - up + middle
    if bend >= 0.0:
        return math.copysign(_LONGEST_STEP, slope), 0.0
    # along the best sizes
    rise -= mixed * slope / bend
    curve = up + down - 2.0 * middle - mixed**2 / bend
    tau = -rise / curve if curve < 0.0 else math.copysign(_LONGEST_STEP, rise)
    tau = min(max(tau, low, -_LONGEST_STEP), high, _LONGEST_STEP)
    size = -(slope + mixed * tau) / bend
    return min(max(size, -_LONGEST_STEP), _LONGEST_STEP), tau


def _cells(density: _Density, mode: _Mode) -> list[GridPoint]:
    """Cells grown outward from a mode."""
    axes = _axes(density, mode.place) * _CELL
    log_cell = math.log(abs(np.linalg.det(axes)))
    best = density(mode.place)
    points = []
    frontier, seen = [(0, 0)], {(0, 0)}
    while frontier and len(seen) < _MOST_CELLS:
        i, j = frontier.pop(0)
        centre = mode.place + axes @ np.array([i, j], dtype=np.float64)
        place, share = _inside(centre, axes, mode.low, mode.high)
        if share == 0.0:
            continue
        value = density(place)
        points.append(density.point(place, log_cell + math.log(share)))
        best = max(best, value)
        if value > best - _DEPTH:
            neighbours = {(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)} - seen
            frontier.extend(sorted(neighbours))
            seen |= neighbours
    return points


def _inside(centre: Array, axes: Array, low: float, high: float) -> tuple[Array, float]:
    """Middle of the part of a cell within bounds of ``log tau``, and the share of that part."""
    places = centre + _SUBCELLS @ axes.T
    inside = (places[:, 1] >= low) & (places[:, 1] <= high)
    share = float(inside.mean())
    if share in (0.0, 1.0):
        return centre, share
    return np.asarray(places[inside].mean(axis=0)), share


def _axes(density: _Density, mode: Array) -> Array:
    """Principal axes, the columns, of a quadratic through a stencil near the mode: one posterior sd long.

    Two passes: the second stencil has the size that the first one found. Lengths stay within reason.
    """
    few = density.of_likely_sets(mode)
    a, b = _STENCIL.T
    basis = np.stack([np.ones(a.size), a, b, 0.5 * a**2, 0.5 * b**2, a * b], axis=1)
    axes = np.diag([0.35, 0.45])
    low, high = math.log(density.prior.tau_low), math.log(density.prior.tau_high)
    for _ in range(2):
        offsets = _STENCIL @ axes.T
        reach = np.max(np.abs(offsets[:, 1])) + _ROUNDING
        centre = np.array([mode[0], min(max(mode[1], low + reach), high - reach)])
        at_edge = centre[1] != mode[1]
        if at_edge:
            # of the prior: the stencil moves inside, along the best sizes
            centre[0], _ = _best_size(few, mode[0], centre[1], _SIZE_STEPS[-1])
        values = np.array([few(centre + offset) for offset in offsets])
        fitted = np.linalg.solve(basis, values)
        inverse = np.linalg.inv(axes)
        bend = np.array([[fitted[3], fitted[5]], [fitted[5], fitted[4]]])
        curvature = -inverse.T @ bend @ inverse
        if at_edge:
            # where the log density falls linearly from it, its slope gives how far it reaches
            slope = inverse.T @ (fitted[1:3] + bend @ inverse @ (mode - centre))
            curvature[1, 1] += slope[1] ** 2
        size, vectors = np.linalg.eigh(curvature)
        axes = vectors / np.sqrt(np.clip(size, 1.0 / 1.2**2, 1.0 / 0.02**2))
    return np.asarray(axes)
