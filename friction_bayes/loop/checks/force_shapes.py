"""The shape of a force in a law's residual: the simple form that best describes how it follows the motion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop import settings
from friction_bayes.loop.checks.added_forces import added_forces
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.statespace.measured_path import MeasuredPath

__all__ = ["ForceShape", "best_shape", "stops"]

_LENGTHS = (0.01, 0.03, 0.1, 0.3)
"""Over the median amplitude: how far after a turning point a pulse reaches."""
_PLACES = np.linspace(-0.9, 0.9, 13)
"""Place of a bump over the largest displacement."""
_STOPS = np.linspace(0.1, 0.8, 8)
"""Where a spring may begin that the motion meets on one side, likewise."""


class ForceShape(NamedTuple):
    """A simple form of a force.

    Attributes
    ----------
    name : str
        In words, with an article.
    share : float
        Of what depends on the motion, in chi-square beyond its expectation, that the form takes; 0 to 1.
    """

    name: str
    share: float


def best_shape(fit: ForceFit, binned: Array) -> ForceShape | None:
    """The form that, as a part of the law, explains most of a binned force.

    None where the law contains all of the forms already, as one with sensor effects can.

    Parameters
    ----------
    fit : ForceFit
    binned : ndarray, shape (nodes, f)
        The binned force in the residual of the law.
    """
    names, columns = zip(*_shapes(fit.path), strict=True)
    bins = slice(0, binned.shape[1])
    added = added_forces(fit, np.column_stack([binned, *columns]))
    whole = added.test(bins)
    # with a single bin that fails, all of them together may pass
    excess = max(whole.statistic - whole.degrees, whole.degrees)
    found = []
    for j, name in enumerate(names, start=binned.shape[1]):
        taken = added.with_law(j)
        if taken is None:
            continue
        drop = whole.statistic - taken.test(bins).statistic
        found.append(ForceShape(name, min(max(drop / excess, 0.0), 1.0)))
    return max(found, key=lambda shape: shape.share, default=None)


def _shapes(path: MeasuredPath) -> Iterator[tuple[str, Array]]:
    """Name and force at the nodes of the path; one name may have several places or lengths."""
    sign, v, middle = path.direction, path.node_v, _middle(path)
    x, turns = path.node_x - middle, np.abs(path.turning_x - middle)
    yield "dry friction", sign
    yield "a force proportional to the velocity", v
    yield "a force proportional to the square of the velocity", np.abs(v) * v
    yield "a force proportional to the displacement", x
    yield "friction proportional to the displacement", sign * x
    yield "friction proportional to the distance from the middle", sign * np.abs(x)
    yield "friction proportional to the amplitude", sign * np.interp(path.node_phase, path.turning, turns)
    yield "friction that changes steadily with time", sign * path.node_phase
    before = np.searchsorted(path.turning, path.node_phase, side="right") - 1
    travelled = np.where(before < 0, np.inf, np.abs(path.node_x - path.turning_x[np.maximum(before, 0)]))
    for length in _LENGTHS:
        yield "a pulse after each turning point", sign * np.exp(-travelled / (length * np.median(turns)))
    reach = float(np.max(np.abs(x)))
    for place in _PLACES:
        bump = np.exp(-0.5 * ((x / reach - place) * settings.SETTINGS.travel_bins) ** 2)
        yield f"a bump {_where(place)}", bump
        yield f"friction that is larger {_where(place)}", sign * bump

    places, springs = stops(path)
    for place, spring in zip(places, springs.T, strict=True):
        yield f"a spring that begins {_where(place)}", spring


def stops(path: MeasuredPath) -> tuple[Array, Array]:
    """Springs that begin at one position, met from one side.

    Returns
    -------
    places : ndarray, shape (f,)
        Over the largest displacement from the middle; the spring lies beyond.
    forces : ndarray, shape (nodes, f)
    """
    x = path.node_x - _middle(path)
    places = np.concatenate([_STOPS, -_STOPS])
    beyond = np.sign(places) * x[:, None] / np.max(np.abs(x)) - np.abs(places)
    return places, np.maximum(beyond, 0.0)


def _middle(path: MeasuredPath) -> float:
    """Of the motion: the mean between successive turning points."""
    return float(np.mean(0.5 * (path.turning_x[1:] + path.turning_x[:-1])))


def _where(place: float) -> str:
    if abs(place) * settings.SETTINGS.travel_bins < 1.0:
        return "in the middle"
    return f"at {place:+.2f} of the largest displacement"
