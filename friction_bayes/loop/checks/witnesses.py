r"""Friction estimated twice: from the loss of amplitude, and from the shape within a cycle.

In each half cycle the force of friction is split, :math:`\phi = g v + (\phi - g v)` with
:math:`g = \int \phi v\,dt / \int v^2\,dt`: the first part takes all of the energy, the second none. Offered
as two columns in place of one, each comes with a friction of its own. A random force blurs the first;
the second is biased by errors of the sensor that follow the direction of motion.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import norm

from friction_bayes.core.arrays import Array
from friction_bayes.core.summary import Summary
from friction_bayes.loop import settings
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.statespace.measured_path import MeasuredPath

__all__ = ["two_witnesses"]


def two_witnesses(fit: ForceFit, unit_force: float, unit: str) -> dict[str, Any]:
    """The report's ``witnesses``: friction by its loss of energy and by its shape, and whether they agree.

    In the best law and random force, the other coefficients free; not cut at zero, since a friction that is
    negative indicates an error. They agree where they differ by no more than by chance. A natural unit of
    force is ``unit_force`` in ``unit``.
    """
    best = fit.posterior.best
    others = fit.regression.sets[fit.chosen].copy()
    # where the best law has no dry friction, both witnesses are of Coulomb friction added to it
    friction = next((j for j in fit.law.frictions if others[j]), fit.law.dry_friction)
    others[friction] = False
    at_nodes, at_samples = _losing_part(fit.path, fit.law.force(friction, fit.path.nodes))
    loss = fit.shown(at_nodes[:, None], at_samples[:, None])[:, 0]
    sds = fit.regression.scale
    scale = np.append(sds[others], [sds[friction]] * 2)
    shape = fit.law.sensor[:, friction] - loss
    columns = np.column_stack([fit.law.sensor[:, others], loss, shape]) * scale
    block = np.column_stack([columns, fit.residual])
    gram = fit.regression.products(block, best)
    # the data are the residual of the best law, about which the prior is nearly centred
    law = np.append(fit.coefficients[others], [fit.coefficients[friction]] * 2) / scale
    noise2, prior = best.noise**2, best.found.full_noise2
    factor = cho_factor(gram[:-1, :-1] + prior * np.eye(scale.size))
    mean = (law + cho_solve(factor, gram[:-1, -1] - prior * law)) * scale
    covariance = noise2 * cho_solve(factor, np.eye(scale.size)) * np.outer(scale, scale)
    sd = np.sqrt(np.diag(covariance))
    apart = math.sqrt(covariance[-2, -2] + covariance[-1, -1] - 2.0 * covariance[-2, -1])
    by_loss, by_shape = (
        Summary.of_distribution(norm(unit_force * mean[j], unit_force * sd[j]), unit).to_dict()
        for j in (-2, -1)
    )
    by_chance = 2.0 * float(norm.sf(abs(mean[-2] - mean[-1]) / apart))
    agree = by_chance > settings.SETTINGS.false_alarm_rate
    return {"loss": by_loss, "shape": by_shape, "agree": agree}


def _losing_part(path: MeasuredPath, force: Array) -> tuple[Array, Array]:
    """The part ``g v`` at nodes, shape (m,), and samples, shape (n,)."""
    half_cycle = np.searchsorted(path.turning, path.node_phase)
    count = path.turning.size + 1
    power = np.bincount(half_cycle, path.node_weight * force * path.node_v, count)
    square = np.bincount(half_cycle, path.node_weight * path.node_v**2, count)
    gain = power / np.maximum(square, 1e-300)
    return gain[half_cycle] * path.node_v, gain[np.searchsorted(path.turning, path.phase)] * path.v
