"""The sets of effects that are evaluated along the measured motion, as sets of columns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import accumulate, chain, combinations, product
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.loop import settings
from friction_bayes.loop.columns.effect_columns import OF_LINES
from friction_bayes.loop.columns.law_columns import SENSOR_ZERO, LawColumns
from friction_bayes.loop.settings import LoopSettings
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.curved_sensor_drift import CURVED_SENSOR_DRIFT
from friction_bayes.mechanics.effects.inclusion import log_probability

__all__ = ["column_sets"]


class _Sets(NamedTuple):
    """Sets of columns, m of them, and what their probabilities are made of.

    Shapes are places among those of all effects, (m, effects at once), in order; beyond the last for none.
    """

    effects: tuple[frozenset[str], ...]
    columns: Mask
    acting: Indices
    log_rub: Array
    shapes: Indices


def column_sets(law: LawColumns, effects: tuple[str, ...]) -> tuple[tuple[frozenset[str], ...], Mask, Array]:
    """Every set of some effects, in each of its shapes, with dry friction and without.

    The effects of each of m sets, its columns, shape (m, p), and the logarithm of its prior probability,
    shape (m,). The shapes of an effect share its probability as the prior of their parameter has it, and so
    do a set with dry friction and without.
    """
    alternatives = ((name, tuple(law.alternatives(name))) for name in effects)
    shapes = tuple((name, own) for name, own in alternatives if own)
    sets = _sets_of(
        shapes,
        always=tuple(law.always),
        frictions=tuple(law.frictions),
        of_friction=tuple(j for j, column in enumerate(law.columns) if column.of_friction),
        columns=len(law.columns),
        known=settings.SETTINGS,
    )
    shares = np.array([*chain(*(_log_shares(law, own) for _, own in shapes)), 0.0])
    logs = np.zeros(len(sets.effects))
    for places in sets.shapes.T:
        logs += shares[places]
    logs += log_probability(np.arange(len(shapes) + 1), len(shapes))[sets.acting] + sets.log_rub
    logs -= float(np.log(np.sum(np.exp(logs))))
    logs.flags.writeable = False
    return sets.effects, sets.columns, logs


@lru_cache(maxsize=32)
def _sets_of(
    shapes: tuple[tuple[str, tuple[tuple[int, ...], ...]], ...],
    *,
    always: tuple[int, ...],
    frictions: tuple[int, ...],
    of_friction: tuple[int, ...],
    columns: int,
    known: LoopSettings,
) -> _Sets:
    """The sets of effects with the columns of each of their shapes, which most rounds and records share."""
    starts = accumulate((len(own) for _, own in shapes), initial=0)
    places = {
        name: range(start, start + len(own)) for (name, own), start in zip(shapes, starts, strict=False)
    }
    # thousands of sets: each is a number whose bits are its columns
    bits = {name: [_bits(each) for each in own] for name, own in shapes}
    in_all, rubbing, shares_of_friction = map(_bits, (always, [LawColumns.dry_friction], of_friction))
    bends = {name for name, own in shapes if not set(frictions).isdisjoint(own[0])}
    rubs, idles = math.log1p(-known.no_dry_friction), math.log(known.no_dry_friction)
    found: list[frozenset[str]] = []
    masks: list[int] = []
    taken: list[tuple[int, ...]] = []
    log_rub: list[float] = []
    for names in _named_sets(tuple(bits), known.most_at_once):
        bent = bends.intersection(names)
        if len(bent) > 1:
            continue
        together = frozenset(names)
        chosen = product(*(places[name] for name in names))
        for choice, own in zip(chosen, product(*(bits[name] for name in names)), strict=True):
            mask = in_all
            for each in own:
                mask |= each
            if bent:
                evaluated = [(mask, 0.0)]
            elif mask & shares_of_friction:
                evaluated = [(mask | rubbing, 0.0)]
            else:
                evaluated = [(mask | rubbing, rubs), (mask, idles)]
            for of_set, log_share in evaluated:
                found.append(together)
                masks.append(of_set)
                taken.append(choice)
                log_rub.append(log_share)
    none, most = sum(map(len, bits.values())), max(map(len, taken))
    filled = np.full((len(found), most), none)
    filled[np.arange(most) < np.array([[len(own)] for own in taken])] = list(chain.from_iterable(taken))
    acting = np.array([len(one) for one in found])
    return _Sets(tuple(found), _unpacked(masks, columns), acting, np.array(log_rub), filled)


def _bits(columns: Sequence[int]) -> int:
    """The number whose bits are these columns."""
    return sum(1 << column for column in set(columns))


def _unpacked(masks: Sequence[int], columns: int) -> Mask:
    """The bits of numbers, shape (m, columns), read-only."""
    size = -(-columns // 8)
    packed = np.frombuffer(b"".join(mask.to_bytes(size, "little") for mask in masks), np.uint8)
    unpacked = np.unpackbits(packed.reshape(-1, size), axis=1, count=columns, bitorder="little")
    unpacked.flags.writeable = False
    return unpacked.view(np.bool_)


def _log_shares(law: LawColumns, shapes: Sequence[tuple[int, ...]]) -> list[float]:
    """Logarithm of the share of an effect's probability that each of its shapes has."""
    first = [law.columns[columns[0]] for columns in shapes]
    taken = [column.shape for column in first]
    # the extents of a series in one shape are equally probable
    return [math.log(column.weight / taken.count(column.shape)) for column in first]


def _named_sets(effects: tuple[str, ...], most: int) -> Iterator[tuple[str, ...]]:
    """Those of at most so many effects; not counted are lines, and the sensor's zero but for its curve."""
    of_lines = tuple(name for name in effects if name in OF_LINES)
    others = [name for name in effects if name not in SENSOR_ZERO and name not in OF_LINES]
    zeros = [(), *((name,) for name in effects if name in SENSOR_ZERO)]
    spectra = [some for size in range(len(of_lines) + 1) for some in combinations(of_lines, size)]
    excluded = [{name, other} for name in effects for other in EFFECTS[name].excludes if other in effects]
    for lines, zero in product(spectra, zeros):
        for size in range(min(most - (CURVED_SENSOR_DRIFT.name in zero), len(others)) + 1):
            for names in combinations(others, size):
                together = (*names, *lines, *zero)
                if not any(pair.issubset(together) for pair in excluded):
                    yield together
