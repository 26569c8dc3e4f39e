"""Forces in addition to a law: how much better would they explain the record, all else of the law free?"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop import settings
from friction_bayes.loop.infer.record_fit import ForceFit

__all__ = ["AddedForces", "ScoreTest", "added_forces"]


class ScoreTest(NamedTuple):
    """Test of several forces at once, and their coefficients by least squares.

    Attributes
    ----------
    statistic : float
        Chi-square.
    degrees : int
        Combinations of the forces that can be distinguished from the law.
    coefficients : ndarray, shape (f,)
    covariance : ndarray, shape (f, f)
    """

    statistic: float
    degrees: int
    coefficients: Array
    covariance: Array


class AddedForces(NamedTuple):
    """Whitened products of forces and the residual, in standard deviations of the noise.

    Attributes
    ----------
    norm : ndarray, shape (f,)
        Length of each force before anything is taken from it.
    gram : ndarray, shape (f, f)
        Of the residuals of the forces after the law.
    score : ndarray, shape (f,)
        Of that with the residual.
    """

    norm: Array
    gram: Array
    score: Array

    def test(self, chosen: slice) -> ScoreTest:
        """Test of some of the forces together."""
        norm = self.norm[chosen]
        values, vectors = np.linalg.eigh(self.gram[chosen, chosen] / np.outer(norm, norm))
        kept = values > settings.SETTINGS.minor_share
        b = vectors[:, kept].T @ (self.score[chosen] / norm)
        basis = vectors[:, kept] / norm[:, None]
        return ScoreTest(
            statistic=float(np.sum(b * b / values[kept])),
            degrees=int(kept.sum()),
            coefficients=basis @ (b / values[kept]),
            covariance=basis @ np.diag(1.0 / values[kept]) @ basis.T,
        )

    def with_law(self, j: int) -> AddedForces | None:
        """The same with force ``j`` as part of the law; None where the law explains it already."""
        own = self.gram[j, j]
        if own <= settings.SETTINGS.minor_share * self.norm[j] ** 2:
            return None
        share = self.gram[j] / own
        return AddedForces(
            self.norm, self.gram - np.outer(share, self.gram[j]), self.score - share * self.score[j]
        )


def added_forces(fit: ForceFit, forces: Array) -> AddedForces:
    """Whitened forces, shape (nodes, f), with the best law projected out."""
    best = fit.posterior.best
    law = np.flatnonzero(fit.sets.columns[fit.chosen])
    # the force itself at the samples: the mean over the nodes of the interval before
    at_samples = np.zeros((fit.path.phase.size, forces.shape[1]))
    if np.any(fit.row[..., 2]):
        np.add.at(at_samples, fit.path.interval + 1, forces * fit.path.node_weight[:, None])
        at_samples[1:] /= np.diff(fit.path.phase)[:, None]
    of_law = fit.law.sensor[:, law] * fit.law.scale[law]
    block = np.column_stack([of_law, fit.shown(forces, at_samples), fit.residual])
    gram = fit.regression.products(block, best) / best.noise**2
    p = law.size
    known = gram[:p, :p] + np.eye(p)
    rest = gram[p:, p:] - gram[:p, p:].T @ np.linalg.solve(known, gram[:p, p:])
    norm = np.sqrt(np.maximum(np.diag(gram)[p:-1], 1e-300))
    return AddedForces(norm, rest[:-1, :-1], rest[:-1, -1])
