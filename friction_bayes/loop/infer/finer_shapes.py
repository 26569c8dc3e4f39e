"""Parameters that shape a term, refined once the record determines them.

The first round evaluates such a parameter at a few values of its prior. About the best of these its term is
linearised: one more column, the derivative of the force in the parameter, gives the values and the spacing of
the next round.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from friction_bayes.core.arrays import Array
from friction_bayes.loop.columns.effect_columns import PRIOR_SCORES, ForceColumn
from friction_bayes.loop.infer.moving_record import LawAlongMotion
from friction_bayes.statespace.force_prior import GridPoint
from friction_bayes.statespace.kalman import whiten
from friction_bayes.statespace.measured_path import Points
from friction_bayes.statespace.response import response_at_sensor

__all__ = ["finer_shapes"]

_WIDEST = 0.5
"""Standard deviation, as a normal score of the prior, above which the values of the prior are used."""
_LONGEST_STEP = 0.8
"""Largest step of one round, as a normal score: the distance of two values of the prior."""
_NUDGE = 1e-3
"""Normal scores over which a force is differenced."""


def finer_shapes(found: LawAlongMotion, law: Array, point: GridPoint) -> dict[str, tuple[float, ...]]:
    """Values at which the shape of each effect of a law is evaluated next.

    Parameters
    ----------
    found : LawAlongMotion
    law : ndarray, shape (p,)
        Its coefficients.
    point : GridPoint
        The random force in addition to it.

    Returns
    -------
    dict
        Normal scores of the prior by effect; without those that are taken all over it.
    """
    regression = found.regression
    bent: dict[str, list[tuple[float, ForceColumn]]] = {}
    for size, each in found.law.with_sizes(law):
        if each.column.shape:
            bent.setdefault(each.column.effect, []).append((size, each))
    if not bent:
        return {}

    def change(points: Points) -> Array:
        return np.column_stack([_change(acting, points) for acting in bent.values()])

    path = found.path
    forces = change(path.nodes), change(path.samples)
    _, shown = response_at_sensor(path, regression.row, *forces, feedback=found.law.feedback)
    own = law != 0.0
    columns = regression.columns[:, own] * regression.scale[own]
    block = np.column_stack([columns, found.law.recorded(shown), regression.residual(law)])
    gram = whiten(block, regression.clock, regression.row, point.ratio, point.tau).gram / point.noise**2
    score = np.array([acting[0][1].column.score for acting in bent.values()])
    # the data are the residual of the law; each coefficient and score has a standard normal prior
    factor = cho_factor(gram[:-1, :-1] + np.eye(len(gram) - 1))
    k = len(score)
    present = np.append(law[own] / regression.scale[own], score)
    move = cho_solve(factor, gram[:-1, -1] - present)[-k:]
    sd = np.sqrt(np.diag(cho_solve(factor, np.eye(len(gram) - 1)))[-k:])
    centre = score + np.clip(move, -_LONGEST_STEP, _LONGEST_STEP)
    return {
        name: tuple((centre[j] + sd[j] * np.array(PRIOR_SCORES)).tolist())
        for j, name in enumerate(bent)
        if sd[j] < _WIDEST
    }


def _change(acting: list[tuple[float, ForceColumn]], points: Points) -> Array:
    """Derivative of a force in the normal score of its shape parameter, shape (m,)."""
    change = np.zeros(points.x.size)
    for size, each in acting:
        score = each.column.score
        change += size * (each.shaped(points, score + _NUDGE) - each.shaped(points, score - _NUDGE))
    return change / (2.0 * _NUDGE)
