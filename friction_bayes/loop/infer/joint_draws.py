"""Draws from the posterior of several records under one law."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.infer.drawn_laws import DrawnLaws
from friction_bayes.loop.infer.draws import shared_out
from friction_bayes.loop.infer.joint_fit import JointFit, spreads_weighed
from friction_bayes.loop.infer.law_draws import LEAST_PROBABILITY, laws_drawn, unit_force
from friction_bayes.loop.infer.truncated_normal import truncated_draws

__all__ = ["joint_draws"]


def joint_draws(
    fit: JointFit, rng: np.random.Generator, draws: int, weight: Array | None = None
) -> DrawnLaws:
    """Draws from each set at each point of the grid and each spread in proportion to its probability.

    Another ``weight`` than the posterior's may be given, shape (points, sets).
    """
    posterior, problem = fit.posterior, fit.problem
    weight = posterior.weight if weight is None else weight / weight.sum()
    weight = np.where(weight > LEAST_PROBABILITY, weight, 0.0)
    counts = shared_out(draws, weight.ravel(), rng)
    laws = np.zeros((draws, len(fit.records), problem.own.size))
    mean = np.zeros((draws, problem.own.size))
    point, row, noise = np.zeros(draws, np.intp), np.zeros(draws, np.intp), np.zeros(draws)
    at = 0
    for flat in np.flatnonzero(counts):
        g, m = divmod(int(flat), weight.shape[1])
        k = int(counts[flat])
        here = slice(at, at + k)
        said = problem.conditional(posterior.points[g], m)
        low = np.where(problem.positive[said.columns], 0.0, -np.inf)
        high = np.full(said.columns.size, np.inf)
        shared = truncated_draws(said.mean, said.covariance, low, high, rng, k)
        mean[here, said.columns] = shared
        laws[here] = said.laws(shared, rng)
        point[here], row[here], noise[here] = g, m, said.noise
        at += k
    chosen = problem.number[row]
    records = tuple(
        laws_drawn(
            one,
            laws[:, r],
            point=point,
            chosen=chosen,
            ratio=posterior.ratio[point] * member.ratio(1.0),
            tau=posterior.tau[point],
            noise=noise * member.noise,
            rng=rng,
        )
        for r, (one, member) in enumerate(zip(fit.fits, problem.members, strict=True))
    )
    frictions = fit.along[0].law.frictions
    force = unit_force(fit.fits[0], records[0].stiffness)
    # a spread represents its part of the prior
    least, second = spreads_weighed()[:2]
    spread = fit.level * fit.spread_of[row] * (second / least) ** rng.uniform(-0.5, 0.5, draws)
    friction = mean[:, frictions].sum(axis=1) * force
    return DrawnLaws(records=records, row=row, friction=friction, spread=spread * force)
