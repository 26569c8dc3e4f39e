"""The open catalogue: looking effects up, adding one, and the parameter vector of the force terms."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError, unknown_name
from friction_bayes.mechanics.effects.effect import Effect, ForceEffect

__all__ = [
    "EFFECTS",
    "check_effects",
    "effect_named",
    "force_effects",
    "force_vector",
    "in_catalogue_order",
    "parse_effects",
    "register",
]

EFFECTS: dict[str, Effect] = {}
"""Every known effect by name, in order of registration."""


def register(effect: Effect) -> Effect:
    """Add an effect to the catalogue.

    A force effect registered from outside is compiled with the integrator at its first use.

    Raises
    ------
    InputError
        If the name is taken, or its series reaches over none of its parameters, more than it has, or priors
        of no width.
    """
    if effect.name in EFFECTS:
        raise InputError(f"effect {effect.name}", "is already registered", "give it another name")
    count = len(effect.parameters)
    for extent in effect.series:
        if not (1 <= extent.parameters <= count and 0.0 < extent.width < math.inf):
            raise InputError(
                f"effect {effect.name}",
                f"its series cannot reach over {extent.parameters} of its {count} parameters with priors "
                f"{extent.width:g} times as wide",
                f"let it reach over 1 to {count}, with priors of a width above zero",
            )
    EFFECTS[effect.name] = effect
    return effect


def in_catalogue_order(names: Collection[str]) -> tuple[str, ...]:
    """Registered effects of some names in the order of the catalogue."""
    return tuple(name for name in EFFECTS if name in names)


def effect_named(name: str) -> Effect:
    """Look an effect up, refusing unknown names with the list of known ones."""
    try:
        return EFFECTS[name]
    except KeyError:
        raise unknown_name("effects", "effect", name, EFFECTS) from None


def parse_effects(settings: Mapping[str, float] | None) -> dict[str, tuple[float, ...]]:
    """Turn ``{"NAME.PARAMETER": value}`` into checked values per effect.

    Parameters
    ----------
    settings : mapping or None
        Values of every parameter without a default, of each effect wanted.

    Returns
    -------
    dict
        Effect name to values in the order of its parameters, in order of the catalogue.

    Raises
    ------
    InputError
        For an unknown effect or parameter, a missing one, a value outside its support, or two effects
        that exclude each other.
    """
    given: dict[str, dict[str, float]] = {}
    for key, value in (settings or {}).items():
        name, dot, parameter = str(key).partition(".")
        effect = effect_named(name)
        if not dot:
            example = f"{name}.{effect.parameters[0].name}"
            raise InputError(f"effect {name}", "names no parameter", f"write it as {example}")
        given.setdefault(name, {})[parameter] = value
    check_effects(given)
    return {name: EFFECTS[name].values(given[name]) for name in EFFECTS if name in given}


def check_effects(names: Mapping[str, object] | tuple[str, ...]) -> None:
    """Refuse unknown effects and pairs that exclude each other."""
    for name in names:
        for other in effect_named(name).excludes:
            if other in names:
                raise InputError("effects", f"{name} and {other} exclude each other", "leave one out")


def force_effects() -> tuple[ForceEffect, ...]:
    """Return the force effects in order of registration."""
    return tuple(effect for effect in EFFECTS.values() if isinstance(effect, ForceEffect))


def force_vector(values: Mapping[str, tuple[float, ...]]) -> Array:
    """Return the parameter vector over all force effects; zeros mean Coulomb friction alone.

    Parameters
    ----------
    values : mapping
        Values per effect, as from :func:`parse_effects`; sensor and noise effects are left out.
    """
    vector: list[float] = []
    for effect in force_effects():
        vector += values.get(effect.name) or (0.0,) * len(effect.parameters)
    return np.array(vector)
