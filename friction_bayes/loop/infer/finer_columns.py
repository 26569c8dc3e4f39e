"""Columns not linear in a parameter: lines found in a residual, refined as shapes are once a law has them.

Lines were found under a law without them, in which the random force represented a part of a second mode, and
a steady line another. The first round evaluates the shape of a term at a few values of its prior. Both are
linearised about what the law has: one more column, the derivative in the parameter, gives a Gauss-Newton
step, and for a shape the spacing of its values in the next round.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from friction_bayes.core.arrays import Array
from friction_bayes.decay.spectral_lines import Line, LineSearch, decaying_lines, steady_lines
from friction_bayes.loop.columns.effect_columns import PRIOR_SCORES, ForceColumn
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.law_along_motion import LawAlongMotion
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.second_mode import SECOND_MODE
from friction_bayes.statespace.force_prior import GridPoint
from friction_bayes.statespace.measured_path import Points

__all__ = ["finer_shapes", "line_search", "lines_in_residual", "lines_kept"]


_LINE_STEP = 0.5
"""Longest, in the logarithm of the decay time, and of the frequency in half widths of the line."""
_WIDEST = 0.5
"""Standard deviation, as a normal score of the prior, above which the values of the prior are used."""
_SHAPE_STEP = 0.8
"""Largest step of one round, as a normal score: the distance of two values of the prior."""
_NUDGE = 1e-3
"""Normal scores over which a force is differenced."""


def line_search(segment: Segment) -> LineSearch:
    """Where lines of a record are looked for."""
    decay = segment.decay
    duration, motion = decay.step * segment.values.size, decay.frequency / (2.0 * math.pi)
    return LineSearch(decay.step, duration, motion)


def lines_in_residual(
    innovations: Array, force: Array, segment: Segment, known: Sequence[Line], effects: Collection[str]
) -> tuple[Line, ...]:
    """Lines of these effects that exceed their surroundings in a spectrum, except known and the motion's.

    In the ``innovations`` under law and random force, in standard deviations, or in that ``force``, which
    hides lines that the oscillator responds to; shape (n,) both.
    """
    search, time = line_search(segment), segment.time[: innovations.size]
    innovations, force = (segment.decay.evenly(each, time) for each in (innovations, force))
    found: tuple[Line, ...] = ()
    if PERIODIC_INTERFERENCE.name in effects:
        found += steady_lines((innovations, force), search, [line for line in known if line.steady])
    if SECOND_MODE.name in effects:
        # not in the force: its spectrum is so steep that windows which begin at once make tops in it
        found += decaying_lines(innovations, search, [line for line in known if not line.steady])
    return found


def lines_kept(found: LawAlongMotion, law: Array, point: GridPoint) -> tuple[Line, ...]:
    """The lines that are larger than noise alone is expected to have one, refined.

    A line that dies out is also a peak in the spectrum of the whole record, as one that lasts, until the law
    of these coefficients, shape (p,), has it. Lines of an effect that the law lacks are kept as they are.
    """
    kept = (_finer_line(line, found, law, point) for line in found.lines)
    return tuple(line for line in kept if line is not None)


def _finer_line(line: Line, found: LawAlongMotion, law: Array, point: GridPoint) -> Line | None:
    """The line, moved by a Gauss-Newton step if it dies out; None where it does not show."""
    regression, own = found.regression, [j for j, c in enumerate(found.law.columns) if c.line == line]
    if not law[own].any():
        return line
    waves = found.law.sensor[:, own]
    power = 0.5 * float(law[own] @ regression.products(waves, point) @ law[own]) / point.noise**2
    if len(waves) * math.exp(-power) > 1.0:
        return None
    if line.steady:
        return line
    sine, cosine = waves.T
    a, b = law[own]
    decayed = regression.clock.phase / (found.w0 * line.decay_time)
    # in half widths of the line, and by the logarithm of the decay time
    slopes = decayed * (a * cosine - b * sine), decayed * (a * sine + b * cosine)
    gram = regression.products(np.column_stack([sine, cosine, *slopes, regression.residual(law)]), point)
    covariance = np.linalg.pinv(gram[:4, :4], rcond=1e-12, hermitian=True)
    faster, longer = np.clip((covariance @ gram[:4, 4])[2:], -_LINE_STEP, _LINE_STEP)
    return Line(
        frequency=line.frequency + faster * line.half_width,
        decay_time=line.decay_time * math.exp(longer),
        scatter=point.noise * math.sqrt(covariance[3, 3]),
    )


def finer_shapes(
    founds: Sequence[LawAlongMotion], laws: Sequence[Array], points: Sequence[GridPoint]
) -> dict[str, tuple[float, ...]]:
    """Values at which the shape of each effect of a law is evaluated next.

    Normal scores of the prior by effect, without those that are taken all over it. Shapes are common to the
    records ``founds``, and so are coefficients that are the same in all of their ``laws``, shape (p,);
    ``points`` are the random forces in addition to these.
    """
    bent = (each.column for _, each in founds[0].law.with_sizes(laws[0]) if each.column.shape)
    scores = {column.effect: column.score for column in bent}
    if not scores:
        return {}
    centre, sd = _likely_scores(scores, founds, laws, points)
    return {
        name: tuple((centre[j] + sd[j] * np.array(PRIOR_SCORES)).tolist())
        for j, name in enumerate(scores)
        if sd[j] < _WIDEST
    }


def _likely_scores(
    scores: dict[str, float],
    founds: Sequence[LawAlongMotion],
    laws: Sequence[Array],
    points: Sequence[GridPoint],
) -> tuple[Array, Array]:
    """Scores of the shapes after a Gauss-Newton step, and their standard deviations, shape (k,) both."""
    acting = np.any([law != 0.0 for law in laws], axis=0)
    same = acting & np.all([law == laws[0] for law in laws], axis=0)
    shared, own = np.flatnonzero(same), np.flatnonzero(acting & ~same)
    taken, s, k = np.append(shared, own), shared.size, len(scores)
    # common coefficients, those of each record, scores
    precision = np.eye(s + own.size * len(founds) + k)
    slope, present = np.zeros((2, len(precision)))
    present[-k:] = list(scores.values())
    for i, (found, law, point) in enumerate(zip(founds, laws, points, strict=True)):
        regression, scale = found.regression, found.regression.scale[taken]
        shown = _shown_changes(scores, found, law)
        block = np.column_stack([regression.columns[:, taken] * scale, shown, regression.residual(law)])
        gram = regression.products(block, point) / point.noise**2
        first = s + own.size * i
        place = np.r_[:s, first : first + own.size, len(precision) - k : len(precision)]
        precision[np.ix_(place, place)] += gram[:-1, :-1]
        slope[place] += gram[:-1, -1]
        present[place[:-k]] = law[taken] / scale
    # the data are the residuals of the law; each coefficient and score has a standard normal prior
    factor = cho_factor(precision)
    move = cho_solve(factor, slope - present)[-k:]
    sd = np.sqrt(np.diag(cho_solve(factor, np.eye(len(precision))))[-k:])
    return present[-k:] + np.clip(move, -_SHAPE_STEP, _SHAPE_STEP), sd


def _shown_changes(scores: Iterable[str], found: LawAlongMotion, law: Array) -> Array:
    """What a record shows of the forces of some effects per normal score of their shapes, shape (n, k)."""
    forces = found.law.with_sizes(law)
    acting = [[pair for pair in forces if pair[1].column.effect == name] for name in scores]

    def change(points: Points) -> Array:
        return np.column_stack([_change(each, points) for each in acting])

    path = found.path
    return found.shown(change(path.nodes), change(path.samples))


def _change(acting: list[tuple[float, ForceColumn]], points: Points) -> Array:
    """Derivative of a force in the normal score of its shape parameter, shape (m,)."""
    change = np.zeros(points.x.size)
    for size, each in acting:
        score = each.column.score
        change += size * (each.shaped(points, score + _NUDGE) - each.shaped(points, score - _NUDGE))
    return change / (2.0 * _NUDGE)
