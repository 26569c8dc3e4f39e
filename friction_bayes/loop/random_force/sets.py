"""The sets of effects that are weighed along the measured motion, as sets of columns."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop.candidate import INCLUSION, MOST_EFFECTS, SENSOR_ZERO
from friction_bayes.loop.random_force.columns import LawColumns
from friction_bayes.mechanics.effects import EFFECTS

__all__ = ["ColumnSets", "column_sets"]

_NO_DRY_FRICTION = 0.2
"""Prior probability that nothing rubs, of the sets of effects that do not bend or scale friction."""


@dataclass(frozen=True, eq=False)
class ColumnSets:
    """Sets of columns and the effects that they are.

    Attributes
    ----------
    effects : tuple of frozenset of str, length m
    columns : ndarray of bool, shape (m, p)
    log_prior : ndarray, shape (m,)
        Logarithm of the prior probability; the shapes of an effect share its probability, and so do a set
        with dry friction and without.
    """

    effects: tuple[frozenset[str], ...]
    columns: Mask
    log_prior: Array


def column_sets(law: LawColumns, effects: tuple[str, ...]) -> ColumnSets:
    """Every set of effects as the search forms them, in each of its shapes, with dry friction and without."""
    found: list[frozenset[str]] = []
    masks, log_prior = [], []
    shapes = {name: law.alternatives(name) for name in effects}
    effects = tuple(name for name in effects if shapes[name])
    frictions, dry_friction = set(law.frictions), law.dry_friction
    bends = {name for name in effects if not frictions.isdisjoint(shapes[name][0])}
    of_friction = np.array([column.of_friction for column in law.columns])
    always = np.isin(np.arange(of_friction.size), law.always)
    for names in _named_sets(effects):
        bent = bends.intersection(names)
        if len(bent) > 1:
            continue
        prior = len(names) * math.log(INCLUSION) + (len(effects) - len(names)) * math.log1p(-INCLUSION)
        choices = list(product(*(shapes[name] for name in names)))
        for choice in choices:
            mask = always.copy()
            for columns in choice:
                mask[list(columns)] = True
            log_share = prior - math.log(len(choices))
            weighed = [(mask, log_share)]
            if not bent:
                rubs = mask.copy()
                rubs[dry_friction] = True
                weighed = [(rubs, log_share)]
                if not of_friction[mask].any():
                    weighed = [
                        (rubs, log_share + math.log1p(-_NO_DRY_FRICTION)),
                        (mask, log_share + math.log(_NO_DRY_FRICTION)),
                    ]
            for columns_used, log_probability in weighed:
                found.append(frozenset(names))
                masks.append(columns_used)
                log_prior.append(log_probability)
    logs = np.array(log_prior)
    return ColumnSets(tuple(found), np.array(masks), logs - float(np.log(np.sum(np.exp(logs)))))


def _named_sets(effects: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    counted = [name for name in effects if name not in SENSOR_ZERO]
    zeros = [(), *((name,) for name in effects if name in SENSOR_ZERO)]
    for size in range(min(MOST_EFFECTS, len(counted)) + 1):
        for names in combinations(counted, size):
            for zero in zeros:
                together = (*names, *zero)
                if not any(other in together for name in together for other in EFFECTS[name].excludes):
                    yield together
