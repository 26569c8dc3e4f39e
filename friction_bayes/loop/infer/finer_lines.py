"""Lines once a law has them: those that exceed noise, and those of a second mode refined.

They were found under a law without them, in which the random force represented a part of a second mode, and
a steady line another.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.columns.lines import Line
from friction_bayes.loop.infer.moving_record import LawAlongMotion
from friction_bayes.statespace.force_prior import GridPoint
from friction_bayes.statespace.kalman import whiten

__all__ = ["finer_lines", "lines_that_show"]

_LONGEST_STEP = 0.5
"""Of the logarithm of the decay time, and of the frequency in half widths of the line."""


def lines_that_show(
    lines: Sequence[Line], found: LawAlongMotion, law: Array, point: GridPoint
) -> tuple[Line, ...]:
    """The lines that are larger than noise alone is expected to have one.

    A line that dies out is also a peak in the spectrum of the whole record, as one that lasts, until the law
    has it. Lines of an effect that the law lacks are kept.

    Parameters
    ----------
    lines : sequence of Line
    found : LawAlongMotion
        The law that may have them.
    law : ndarray, shape (p,)
        Its coefficients.
    point : GridPoint
        The random force in addition to it.
    """
    regression = found.regression
    showing = []
    for line in lines:
        own = [j for j, column in enumerate(found.law.columns) if column.line == line]
        if law[own].any():
            waves = found.law.sensor[:, own]
            gram = whiten(waves, regression.clock, regression.row, point.ratio, point.tau).gram
            power = 0.5 * float(law[own] @ gram @ law[own]) / point.noise**2
            if len(waves) * math.exp(-power) > 1.0:
                continue
        showing.append(line)
    return tuple(showing)


def finer_lines(
    lines: Sequence[Line], found: LawAlongMotion, law: Array, point: GridPoint
) -> tuple[Line, ...]:
    """The lines, those that die out moved by a Gauss-Newton step of frequency and decay time.

    Parameters
    ----------
    lines : sequence of Line
    found : LawAlongMotion
        The law that has them.
    law : ndarray, shape (p,)
        Its coefficients.
    point : GridPoint
        The random force in addition to it.
    """
    regression = found.regression
    finer = []
    for line in lines:
        own = [j for j, column in enumerate(found.law.columns) if column.line == line]
        if line.steady or not law[own].any():
            finer.append(line)
            continue
        sine, cosine = found.law.sensor[:, own].T
        a, b = law[own]
        decayed = (regression.clock.phase - regression.clock.phase[0]) / (found.w0 * line.decay_time)
        # in half widths of the line, and by the logarithm of the decay time
        slopes = decayed * (a * cosine - b * sine), decayed * (a * sine + b * cosine)
        columns = np.column_stack([sine, cosine, *slopes, regression.residual(law)])
        gram = whiten(columns, regression.clock, regression.row, point.ratio, point.tau).gram
        covariance = np.linalg.pinv(gram[:4, :4], rcond=1e-12, hermitian=True)
        faster, longer = np.clip((covariance @ gram[:4, 4])[2:], -_LONGEST_STEP, _LONGEST_STEP)
        finer.append(
            Line(
                frequency=line.frequency + faster * line.half_width,
                decay_time=line.decay_time * math.exp(longer),
                scatter=point.noise * math.sqrt(covariance[3, 3]),
            )
        )
    return tuple(finer)
