"""Friction and precision of the paper's pair as its friction samples come in: Fig. 4 of the paper."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.core.summary import TAILS
from friction_bayes.decay.friction_samples import friction_samples
from friction_bayes.estimators.result import Estimate
from friction_bayes.plotting.style import DATA, MODEL, Panels, panels_of, styled

__all__ = ["samples_used"]


def samples_used(estimate: Estimate, *, axes: Sequence[Axes] | None = None) -> Panels:
    """Draw friction and precision against the number of friction samples used: Fig. 4.

    Parameters
    ----------
    estimate : Estimate
        By ``normal-gamma``.
    axes : sequence of two matplotlib.axes.Axes, optional

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (2,)

    Raises
    ------
    InputError
        If it is by another method, or ``axes`` are not two.
    """
    count, means, intervals = _after_each_sample(estimate)
    units = {"friction": estimate.friction_unit, "precision": estimate.precision_unit}
    with styled():
        panels = panels_of(axes, 2, height=5.6)
        for each, (name, unit) in zip(panels, units.items(), strict=True):
            each.fill_between(count, *intervals[name], color=DATA, alpha=0.3, lw=0.0, label="90 %")
            each.plot(count, means[name], color=MODEL, marker=".", label=f"{name}, posterior mean")
            each.set_ylabel(f"{name} [{unit}]")
            each.legend(loc="upper right")
        panels[1].set_xlabel("friction samples used [number]")
        panels[0].set_title(f"{estimate.decay.name}, {estimate.peaks} peaks")
    return panels


def _after_each_sample(estimate: Estimate) -> tuple[list[int], dict[str, Array], dict[str, Array]]:
    """Numbers of samples whose posterior is proper, and means and 90 % intervals of what is drawn."""
    if not isinstance(estimate.fit.posterior, NormalGamma):
        raise InputError(
            "estimate", f"{estimate.method} takes no friction samples one by one", "give one by normal-gamma"
        )
    prior, samples = NormalGamma(**estimate.prior), friction_samples(estimate.decay, estimate.peaks)
    after = {n: pair for n in range(1, samples.size + 1) if (pair := prior.update(samples[:n])).proper}
    means, intervals = {}, {}
    for name in ("friction", "precision"):
        marginals = [getattr(pair, name) for pair in after.values()]
        means[name] = np.array([marginal.mean() for marginal in marginals])
        intervals[name] = np.array([marginal.ppf(TAILS) for marginal in marginals]).T
    return [*after], means, intervals
