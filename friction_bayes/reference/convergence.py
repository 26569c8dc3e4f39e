"""Whether ensembles have converged: nested R-hat, effective sample sizes, length."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from arviz_stats.base import array_stats

from friction_bayes.core.arrays import Array
from friction_bayes.validation.mixing import bulk_ess, mixing, tail_ess

__all__ = ["MAXIMUM_RHAT", "MINIMUM_LENGTH", "Convergence", "diagnose"]


MAXIMUM_RHAT = 1.01
MINIMUM_LENGTH = 50
"""Steps after burn-in, in integrated autocorrelation times."""


@dataclass(frozen=True, kw_only=True)
class Convergence:
    """Diagnostics of one parameter, or the worst of several.

    Attributes
    ----------
    nested_rhat : float
        Rank-normalised split nested R-hat, ensembles for superchains (Margossian et al. 2024).
    ess_bulk, ess_tail : float
        Effective sample sizes from the autocorrelation of ensemble means.
    tau : float
        Integrated autocorrelation time [steps], from ``ess_bulk``.
    mcse_mean : float
        Monte Carlo standard error of the mean, unit of the parameter (nan for the worst of several).
    """

    nested_rhat: float
    ess_bulk: float
    ess_tail: float
    tau: float
    mcse_mean: float

    def met(self, *, ess: float, steps: int) -> bool:
        """Whether all thresholds are met by ``steps`` steps after burn-in."""
        return (
            self.nested_rhat < MAXIMUM_RHAT
            and min(self.ess_bulk, self.ess_tail) > ess
            and steps > MINIMUM_LENGTH * self.tau
        )

    def describe(self, *, ess: float, steps: int) -> str:
        """Give the figures with their thresholds."""
        return (
            f"nested R-hat {self.nested_rhat:.4f} (below {MAXIMUM_RHAT}), "
            f"bulk and tail effective sample size {self.ess_bulk:.0f} and {self.ess_tail:.0f} "
            f"(above {ess:.0f}), {steps / self.tau:.0f} autocorrelation times (above {MINIMUM_LENGTH})"
        )

    @classmethod
    def worst(cls, several: Mapping[str, Convergence]) -> Convergence:
        """Return the worst figure of each kind."""
        return cls(
            nested_rhat=max(c.nested_rhat for c in several.values()),
            ess_bulk=min(c.ess_bulk for c in several.values()),
            ess_tail=min(c.ess_tail for c in several.values()),
            tau=max(c.tau for c in several.values()),
            mcse_mean=float("nan"),
        )


def diagnose(draws: Array, ensembles: int, thinning: int) -> Convergence:
    """Judge the draws of one parameter.

    Parameters
    ----------
    draws : ndarray, shape (chains, draws)
        Walkers, ensemble after ensemble.
    ensembles : int
        How many ensembles they are of.
    thinning : int
        Steps from one draw to the next.
    """
    walkers = draws.shape[0] // ensembles
    grouped = draws.reshape(ensembles, walkers, -1)
    owner = np.repeat(np.arange(ensembles), walkers)
    bulk, plain = bulk_ess(grouped), mixing(grouped)
    return Convergence(
        nested_rhat=float(array_stats.rhat_nested(draws, owner, chain_axis=0, draw_axis=1)),
        ess_bulk=bulk.ess,
        ess_tail=tail_ess(grouped).ess,
        tau=thinning * bulk.tau,
        mcse_mean=float(draws.std() / np.sqrt(plain.ess)) if plain.ess > 0.0 else float("inf"),
    )
