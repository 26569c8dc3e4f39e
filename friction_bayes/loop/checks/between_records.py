r"""Records compared: whether they contradict one law for all, and the friction of each and its spread.

Friction may differ between records, a shared effect may not. Where it does, other effects and the random
force take up the difference, and the best common law fits no record. So each record is given sizes of its
own: the most probable set then has coefficients :math:`m_r` in record r, with covariance :math:`C_r` over all
else in the set (by the samples alone: in a record with little information, the prior is no evidence of a
small effect), and

.. math:: \chi^2 = \sum_r (m_r - \bar m)^T C_r^{-1} (m_r - \bar m), \qquad
   \bar m = \Big(\sum_r C_r^{-1}\Big)^{-1} \sum_r C_r^{-1} m_r

is chi-square with ``(r - 1) k`` degrees of freedom for an effect of ``k`` columns that is as large in all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import chi2

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.summary import Summary
from friction_bayes.loop import settings
from friction_bayes.loop.infer.law_draws import DRAWS, DrawnLaws, draw_laws
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.subset_evidence import set_posterior

__all__ = ["Comparison", "compared_sizes", "contradictions", "friction_between_records"]

_PRIOR = 1e-4
"""Share of the prior precision with which sizes by themselves are computed: enough for uniqueness."""


class Comparison(NamedTuple):
    """An effect in r records: chi-square of its sizes about the common one, and its degrees of freedom.

    Shares are each record's coefficients over the common ones, shape (r, k).
    """

    effect: str
    chi_square: float
    freedom: int
    share: Array
    share_sd: Array

    @property
    def p_value(self) -> float:
        """Probability of sizes that differ as much or more, where one is that of all."""
        return float(chi2.sf(self.chi_square, self.freedom))


def contradictions(fit: LawFit) -> Iterator[str]:
    """Sentences on the effects for which the records contradict a common size; none of one record."""
    found = [] if fit.one else compared_sizes(fit)
    for one in found:
        if one.p_value >= settings.SETTINGS.false_alarm_rate / len(found):
            continue
        shares = ""
        if one.share.shape[1] == 1:
            each = zip(fit.fits, one.share[:, 0], one.share_sd[:, 0], strict=True)
            shares = ", over the common size: " + ", ".join(
                f"{record.segment.decay.name} {share:.2f} ± {sd:.2f}" for record, share, sd in each
            )
        yield (
            f"the records contradict one {one.effect} for all (chi-square {one.chi_square:.3g}, degrees of "
            f"freedom {one.freedom}, p {one.p_value:.1g}{shares}); other effects or the random force take up "
            "what differs: close the loop on each record by itself"
        )


def compared_sizes(fit: LawFit) -> list[Comparison]:
    """Chi-square of each effect that all records share, in the set that is best where sizes may differ.

    Effects of which each record has its own, and those that are shares of friction, which may differ between
    the records, are not compared.
    """
    law = fit.law
    mean, covariance, columns = _by_themselves(fit)
    places: dict[str, list[int]] = {}
    for place, j in enumerate(columns):
        column = law.columns[j]
        if column.kind == "effect" and not column.own and not column.of_friction:
            places.setdefault(column.effect, []).append(place)
    return [_compared(effect, mean[:, at], covariance[:, at][:, :, at]) for effect, at in places.items()]


def _compared(effect: str, mean: Array, covariance: Array) -> Comparison:
    precision = np.linalg.inv(covariance)
    common = np.linalg.solve(precision.sum(axis=0), np.einsum("rij,rj->i", precision, mean))
    away = mean - common
    return Comparison(
        effect=effect,
        chi_square=float(np.einsum("ri,rij,rj->", away, precision, away)),
        freedom=(len(mean) - 1) * common.size,
        share=mean / common,
        share_sd=np.sqrt(np.einsum("rii->ri", covariance)) / np.abs(common),
    )


def _by_themselves(fit: LawFit) -> tuple[Array, Array, Integers]:
    """Estimates of each record, under its own noise and random force, in the set that is best for all then.

    Means (r, s) and covariances (r, s, s) of the coefficients, in units of their prior sd, and their columns.
    """
    common, found = fit.fits[0].regression, []
    for one, alone in zip(fit.fits, fit.alone, strict=True):
        motion, regression = alone.motion, one.regression
        ratio, tau = motion.force_sd / motion.noise, motion.tau
        whitened = regression.whiten_at(ratio, tau)
        found.append((regression.reference, whitened, Problem.of(regression).evaluate(ratio, tau)))
    likelihood = sum(evaluated.log_weight - common.log_prior for _, _, evaluated in found)
    best = int(np.argmax(likelihood + common.log_prior))
    inside = common.sets[best]
    estimates = [
        set_posterior(
            whitened.gram,
            reference,
            inside,
            _PRIOR * evaluated.full_noise2,
            float(evaluated.noise2[best]),
        )
        for reference, whitened, evaluated in found
    ]
    mean, covariance = (np.array(values) for values in zip(*estimates, strict=True))
    return mean, covariance, np.flatnonzero(inside)


def friction_between_records(
    laws: DrawnLaws,
    alone: Sequence[ForceFit],
    *,
    shift: Array,
    probability: float,
    scale: Array,
    unit: str,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """The report's ``friction_between_records``, of laws (k draws) and of each record by itself.

    What slight effects that all records share add to the friction of each is the ``shift``, shape (k,) [N or
    N m], and ``scale``, shape (k,), has draws of the factor to the reported friction and its ``unit``. The
    ``probability`` is that friction differs.
    """
    differs = laws.spread > 0.0
    spread = laws.spread[differs]
    return {
        "probability": probability,
        "spread": Summary.of_draws(scale[differs] * spread, unit).to_dict() if spread.size > 1 else None,
        "share_of_friction": float(np.median(spread / laws.friction[differs])) if spread.size else 0.0,
        "reduced_chi_square": _reduced_chi_square(alone, rng),
        "records": [
            {
                "name": one.fit.segment.decay.name,
                "friction": Summary.of_draws(np.abs(scale * (one.friction + shift)), unit).to_dict(),
            }
            for one in laws.records
        ],
    }


def _reduced_chi_square(alone: Sequence[ForceFit], rng: np.random.Generator) -> float | None:
    """Reduced chi-square of the frictions by each record alone, about their weighted mean.

    None where one has surely none: it has no scatter to compare with.
    """
    drawn = [draw_laws(LawFit.of(one), rng, DRAWS).friction for one in alone]
    if not all(x.any() for x in drawn):
        return None
    mean, weight = np.array([x.mean() for x in drawn]), np.array([1.0 / x.var() for x in drawn])
    centre = float(weight @ mean / weight.sum())
    return float(weight @ (mean - centre) ** 2 / (len(drawn) - 1))
