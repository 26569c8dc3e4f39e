"""Draws of the law that one or several records share, and of each record's own parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.loop.infer.law_draws import LawDraws
from friction_bayes.mechanics.effects import EFFECTS, GrowingNoiseEffect
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE

__all__ = ["DrawnLaws"]


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnLaws:
    """Joint draws of the law, of each record's own parameters, and of the spread between records.

    Attributes
    ----------
    records : tuple of LawDraws, length r
        Those of each record, of its own friction.
    row : ndarray of int, shape (k,)
        Which of the posterior's sets each draw has.
    friction : ndarray, shape (k,)
        Mean friction [N or N m]: that of all records where it does not differ between them.
    spread : ndarray, shape (k,)
        Spread of friction between records [N or N m]; zero where it does not differ.
    """

    records: tuple[LawDraws, ...]
    row: Integers
    friction: Array
    spread: Array

    @classmethod
    def of_one(cls, draws: LawDraws) -> DrawnLaws:
        """Those of one record."""
        none = np.zeros_like(draws.friction)
        return cls(records=(draws,), row=draws.chosen, friction=draws.friction, spread=none)

    @property
    def first(self) -> LawDraws:
        """Those of the first record."""
        return self.records[0]

    @property
    def frequency(self) -> Array:
        """Natural frequency [rad/s], shape (k,)."""
        return np.asarray(self.first.fit.w0 * np.sqrt(np.maximum(1.0 + self.first.stiffness, 0.25)))

    @property
    def scores(self) -> Array:
        """Coefficients of effects in units of their prior sd, shape (k, c); zero where a law lacks one.

        Each record's own are counted in addition to the shared ones.
        """
        own = np.array([column.own for column in self.first.fit.law.columns])
        return np.hstack([_scores(self.first, ~own), *(_scores(draws, own) for draws in self.records)])

    def parameters(self, effect: str, chosen: Mask) -> dict[str, Array]:
        """Parameters of an effect in the ``chosen`` draws that have it, a record's own with its number."""
        if isinstance(EFFECTS[effect], GrowingNoiseEffect):
            return {EFFECTS[effect].parameters[0].name: self.first.noise_growth[chosen]}
        if effect == RANDOM_FORCE.name:
            return {
                "sd": self.first.random_force[chosen],
                "correlation_time": self.first.correlation_time[chosen],
            }
        own = any(column.own for column in self.first.fit.law.columns if column.effect == effect)
        if len(self.records) == 1 or not own:
            # a share of friction is one of the mean friction
            return _parameters(replace(self.first, friction=self.friction), effect, chosen)
        return {
            f"{name}[{r}]": values
            for r, draws in enumerate(self.records)
            for name, values in _parameters(draws, effect, chosen).items()
        }


def _scores(draws: LawDraws, wanted: Mask) -> Array:
    law = draws.fit.law
    mine = wanted & np.array([column.kind == "effect" for column in law.columns])
    return np.asarray(draws.coefficients[:, mine] / law.scale[mine])


def _parameters(draws: LawDraws, effect: str, chosen: Mask) -> dict[str, Array]:
    """Parameters as in the catalogue: a line of interference by amplitude and phase."""
    values = draws.parameters(effect, chosen)
    if effect == PERIODIC_INTERFERENCE.name:
        sine, cosine = values["sine"], values["cosine"]
        values |= {"amplitude": np.hypot(sine, cosine), "phase": np.arctan2(cosine, sine)}
    return {parameter.name: values[parameter.name] for parameter in EFFECTS[effect].parameters}
