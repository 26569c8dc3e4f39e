"""Options of a closed loop, checked once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from friction_bayes.core.checks import positive
from friction_bayes.core.errors import InputError, unknown_name
from friction_bayes.estimators.estimate import RANDOM_FORCE_CHOICES
from friction_bayes.mechanics.effects import EFFECTS, effect_named, in_catalogue_order
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE

__all__ = ["NOISES", "TOLERANCE", "LoopOptions"]

NOISES = ("auto", "white", "ar")
TOLERANCE = 0.2


@dataclass(frozen=True, kw_only=True)
class LoopOptions:
    """Options of :func:`friction_bayes.close_loop`, which describes each of them."""

    seed: int
    effects: tuple[str, ...] | None
    exclude: tuple[str, ...]
    noise: str
    random_force: str
    varying_friction: bool
    tolerance: float
    check: bool
    reference_friction: float | None

    def validate(self, records: Sequence[xr.DataArray]) -> None:
        """Refuse options that cannot be used with the records."""
        if isinstance(records, np.ndarray):
            raise InputError(
                "records",
                "ndarray instead of a record or a list of records",
                "make_record(time, values, quantity) makes one of an array",
            )
        for place, value, choices in (
            ("noise", self.noise, NOISES),
            ("random_force", self.random_force, RANDOM_FORCE_CHOICES),
        ):
            if value not in choices:
                raise unknown_name(place, "choice", value, choices)
        positive("tolerance", self.tolerance)
        if self.reference_friction is not None:
            positive("reference_friction", self.reference_friction)
        if self.varying_friction and len(records) < 2:
            raise InputError(
                "varying_friction", "one record", "give the records between which friction differs"
            )
        for name in (*(self.effects or ()), *self.exclude):
            effect_named(name)

    @property
    def allowed(self) -> tuple[str, ...]:
        """Effects that may be tried, in the catalogue's order."""
        wanted = EFFECTS if self.effects is None else self.effects
        without = self.exclude if self.random_force == "auto" else (*self.exclude, RANDOM_FORCE.name)
        return in_catalogue_order(set(wanted).difference(without))
