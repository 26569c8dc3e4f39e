"""The posterior of an estimate sampled: one target, or one with a random force and one without."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.estimators.estimate import estimate
from friction_bayes.estimators.result import Estimate
from friction_bayes.estimators.waveform.averaged import SURELY_NONE
from friction_bayes.reference.sampling import sample_target

__all__ = ["parts_of", "sample_estimate", "sample_reference"]

_OTHER_PART = "other_part"


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
        As from :func:`sample_estimate`, with the attributes ``record``, ``method`` and ``friction_unit``.
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

    An estimate that averages over a random force has two parts, with one and without. They differ in their
    parameters and are told apart by evidence, which a sampler does not give: each is sampled on its own
    target, and both are mixed with the closed form's probability. A part below a thousandth is left out.

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
        The only part, or the more probable one, as from :func:`friction_bayes.reference.sample_target`;
        attribute ``random_force`` says (1 or 0) whether it has one. Where there are two, group ``other_part``
        holds the other in the same layout, and ``mixture`` the friction of both, in proportion.
    """
    force = closed_form.random_force
    targets = {0: closed_form.fit.target}
    probability = 0.0
    if force is not None and force.probability >= SURELY_NONE:
        probability = force.probability
        targets[1] = force.target
        if probability > 1.0 - SURELY_NONE:
            del targets[0]
    parts = {}
    for has, target in targets.items():
        parts[has] = sample_target(target, seed=seed, progress=progress, **options)
        parts[has].attrs["random_force"] = has
    if len(parts) == 1:
        return next(iter(parts.values()))
    first = int(probability > 0.5)
    tree, ensembles = parts[first], int(parts[first].attrs["ensembles"])
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(2,)))
    mixed = _mixed(parts[0], parts[1], probability, rng)
    mixture = xr.Dataset(
        {"friction": (("chain", "draw"), mixed)},
        coords={"ensemble": ("chain", np.repeat(np.arange(ensembles), len(mixed) // ensembles))},
        attrs={"probability_of_random_force": probability},
    )
    tree["mixture"] = xr.DataTree(mixture)
    tree[_OTHER_PART] = parts[1 - first]
    return tree


def parts_of(tree: xr.DataTree) -> tuple[xr.DataTree, ...]:
    """The one or two parts that :func:`sample_estimate` has sampled, the more probable one first."""
    return (tree, tree.children[_OTHER_PART]) if _OTHER_PART in tree.children else (tree,)


def _mixed(without: xr.DataTree, beside: xr.DataTree, probability: float, rng: np.random.Generator) -> Array:
    """Friction of two parts, shape (chains, draws), each draw from one of them.

    As many walkers of each ensemble, and as many draws, as both have: evenly taken where one has more.
    """
    grouped = [
        np.asarray(part["posterior"].dataset["friction"].values).reshape(
            part.attrs["ensembles"], part.attrs["walkers"], -1
        )
        for part in (without, beside)
    ]
    walkers, draws = (min(each.shape[axis] for each in grouped) for axis in (1, 2))
    even = [
        each[:, :walkers][:, :, np.linspace(0, each.shape[2] - 1, draws).round().astype(int)]
        for each in grouped
    ]
    mixed = np.where(rng.random(even[0].shape) < probability, even[1], even[0])
    return np.asarray(mixed.reshape(-1, draws))
