r"""What takes energy beside constant dry friction: damping, drag, friction that changes with time.

Each is a force along a path, whose response is a column of the law:

.. math:: -c\,v, \qquad -c\,v|v|, \qquad -c\,(t/T - \tfrac12)\,\mathrm{sign}\,v

A coefficient is measured by the share of the loss that it takes: of one that took all of it, friction being
what dry friction alone would have to be. Damping and drag do not drive; friction may fall or grow, and its
mean over the record is what is estimated.
"""

from __future__ import annotations

import math
from itertools import product
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.statespace.measured_path import MeasuredPath, Points
from friction_bayes.statespace.response import at_sensor, force_response

__all__ = ["DRIFTING", "LOSSES", "LossColumns", "loss_columns", "loss_sets"]

LOSSES = DAMPING, DRAG, DRIFTING = "viscous damping", "quadratic drag", "friction that changes with time"
"""In words."""
_PROBABILITY = MappingProxyType({DAMPING: 0.15, DRAG: 0.05, DRIFTING: 0.05})
"""Prior probability of each, whichever others there are: most machines are damped a little."""
_SIZES = (1.0, 0.5, 0.25, 0.125)
"""Prior sds of the share of the loss that one of them takes, as probable as each other: few take much."""


class LossColumns(NamedTuple):
    """Columns of the losses, each once for every prior sd.

    Attributes
    ----------
    names : tuple of str, length k
        The loss that each is of.
    sensor : ndarray, shape (n, k)
        As the sensor reads it, natural units.
    states : ndarray, shape (n, 2, k)
        Displacement and velocity.
    scale : ndarray, shape (k,)
        Prior sd of the coefficient.
    positive : ndarray of bool, shape (k,)
        Whether it has to be positive.
    """

    names: tuple[str, ...]
    sensor: Array
    states: Array
    scale: Array
    positive: Mask


def loss_columns(path: MeasuredPath, row: Array, friction: float) -> LossColumns:
    """Columns of the losses along a path.

    Parameters
    ----------
    path : MeasuredPath
        In natural units.
    row : ndarray, shape (3,) or (n, 3)
        With which the sensor reads the state.
    friction : float
        Displacement ``r/k`` that would explain the whole loss, natural units.
    """
    middle, duration = 0.5 * (path.phase[0] + path.phase[-1]), path.phase[-1] - path.phase[0]
    power = path.x**2 + path.v**2
    # friction takes 4 r/k A in a cycle, damping pi c A**2, drag 8/3 c A**3
    whole = {
        DAMPING: 4.0 * friction / (math.pi * float(np.mean(np.sqrt(power)))),
        DRAG: 1.5 * friction / float(np.mean(power)),
        DRIFTING: friction,
    }

    def forces(points: Points) -> Array:
        when = (points.phase - middle) / duration
        return -np.column_stack([points.v, points.v * np.abs(points.v), when * points.direction])

    states = force_response(path, forces(path.nodes))
    sensor, times = at_sensor(states, row, forces(path.samples)), len(_SIZES)
    return LossColumns(
        names=tuple(name for name in whole for _ in _SIZES),
        sensor=np.repeat(sensor, times, axis=1),
        states=np.repeat(states, times, axis=2),
        scale=np.outer(list(whole.values()), _SIZES).ravel(),
        positive=np.repeat([name != DRIFTING for name in whole], times),
    )


def loss_sets() -> tuple[Mask, Array]:
    """Which of these columns act together, shape (m, k), and the logarithm of the prior odds, shape (m,).

    None comes first, and has the odds one. Each loss has one prior sd at most.
    """
    choices = list(product(range(len(_SIZES) + 1), repeat=len(_PROBABILITY)))
    sizes = np.arange(1, len(_SIZES) + 1)
    odds = [p / (1.0 - p) / len(_SIZES) for p in _PROBABILITY.values()]
    sets = np.array([np.concatenate([sizes == each for each in choice]) for choice in choices])
    logs = [sum(math.log(own) for own, each in zip(odds, choice, strict=True) if each) for choice in choices]
    return sets, np.array(logs)
