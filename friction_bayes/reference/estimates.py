"""The posterior of an estimate sampled: one target, or one for each account of the noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.estimators.estimate import estimate
from friction_bayes.estimators.result import Estimate
from friction_bayes.reference.sampling import sample_target
from friction_bayes.reference.tree import by_walker, numbered

__all__ = ["parts_of", "sample_estimate", "sample_reference"]


def sample_reference(
    record: xr.DataArray,
    system: Oscillator,
    *,
    method: str = "waveform",
    prior: Mapping[str, float] | Any | None = None,
    peaks: str = "highest",
    start: float | None = None,
    rest_position: float | None = None,
    random_force: str = "auto",
    seed: int,
    **options: Any,
) -> xr.DataTree:
    """Sample the posterior that :func:`friction_bayes.estimate` gives in closed form.

    Parameters
    ----------
    record, system, method, prior, peaks, start, rest_position, random_force
        As for :func:`friction_bayes.estimate`.
    seed : int
        Same seed, same bits.
    **options
        Further arguments of :func:`friction_bayes.reference.sample_target`.

    Returns
    -------
    xarray.DataTree
        As from ``sample_estimate``, with the attributes ``record``, ``method`` and ``friction_unit``.
        Forces are those of the declared mass and stiffness, without their uncertainty.

    Raises
    ------
    InputError
        If the record cannot be used or an argument is wrong.

    Warns
    -----
    NotConvergedWarning
        If the steps were used up before the diagnostics were met.
    """
    closed_form = estimate(
        record,
        system,
        method=method,
        prior=prior,
        peaks=peaks,
        start=start,
        rest_position=rest_position,
        random_force=random_force,
    )
    tree = sample_estimate(closed_form, seed=seed, **options)
    tree.attrs.update(record=closed_form.decay.name, method=method, friction_unit=closed_form.friction_unit)
    return tree


def sample_estimate(
    closed_form: Estimate,
    *,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> xr.DataTree:
    """Sample the posterior of an estimate, each of its parts on its own.

    An estimate that averages over accounts of the noise has several parts. They differ in their parameters
    and are compared by evidence, which a sampler does not give: each is sampled on its own target, and all
    are mixed with the closed form's probabilities. A part below a thousandth is left out.

    Parameters
    ----------
    closed_form : Estimate
    seed : int
        Same seed, same bits.
    progress : callable, optional
        As for :func:`friction_bayes.reference.sample_target`, for one part after the other.
    **options
        Further arguments of that function.

    Returns
    -------
    xarray.DataTree
        The most probable part, as from :func:`friction_bayes.reference.sample_target`; attribute
        ``random_force`` says (1 or 0) whether it has one, ``part`` what it is. Where there are several,
        groups ``other_part``, ``other_part_2``, ... hold the others in the same layout, and ``mixture`` the
        friction of all, in proportion.
    """
    declared = sorted(closed_form.fit.parts, key=lambda part: -part.probability)
    trees = []
    for part in declared:
        tree = sample_target(part.build_target(), seed=seed, progress=progress, **options)
        tree.attrs.update(random_force=int(part.forced), part=part.name)
        trees.append(tree)
    first, *others = trees
    if not others:
        return first
    share = np.array([part.probability for part in declared])
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(2,)))
    mixed = _mixed(trees, share / share.sum(), rng)
    mixture = xr.Dataset(
        {"friction": (("chain", "draw"), mixed.reshape(len(mixed), -1))},
        coords=numbered(*mixed.shape),
        attrs={part.name: part.probability for part in declared},
    )
    first["mixture"] = xr.DataTree(mixture)
    for i, tree in enumerate(others, start=1):
        first[_other_part(i)] = tree
    return first


def parts_of(tree: xr.DataTree) -> tuple[xr.DataTree, ...]:
    """The parts that :func:`sample_estimate` has sampled, the most probable one first."""
    parts = [tree]
    while _other_part(len(parts)) in tree.children:
        parts.append(tree.children[_other_part(len(parts))])
    return tuple(parts)


def _other_part(number: int) -> str:
    return "other_part" if number == 1 else f"other_part_{number}"


def _mixed(parts: Sequence[xr.DataTree], share: Array, rng: np.random.Generator) -> Array:
    """Friction of several parts, shape (ensembles, walkers, draws), each draw from one of them.

    As many walkers of each ensemble, and as many draws, as all have: evenly taken where one has more.
    """
    grouped = [by_walker(part["posterior"].dataset["friction"]) for part in parts]
    walkers, draws = (min(each.shape[axis] for each in grouped) for axis in (1, 2))
    even = np.stack(
        [
            each[:, :walkers][:, :, np.linspace(0, each.shape[2] - 1, draws).round().astype(int)]
            for each in grouped
        ]
    )
    which = rng.choice(len(parts), size=even.shape[1:], p=share)
    return np.asarray(np.take_along_axis(even, which[None], axis=0)[0])
