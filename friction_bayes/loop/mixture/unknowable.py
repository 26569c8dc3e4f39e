"""Effects on which a record has no information."""

from __future__ import annotations

import numpy as np

from friction_bayes.loop import settings
from friction_bayes.loop.infer.record_fit import ForceFit

__all__ = ["unknowable"]


def unknowable(fit: ForceFit) -> set[str]:
    """Effects on which the samples have almost no information, start and friction free.

    A constant force in an acceleration record is one: its probability would stay that of its prior.
    """
    always = [*fit.law.always, fit.law.dry_friction]
    gram = fit.regression.whiten_at(0.0, 1.0).gram[:-1, :-1] / fit.posterior.points[0].found.full_noise2
    absorbed = np.linalg.solve(gram[np.ix_(always, always)] + np.eye(len(always)), gram[always])
    left = np.diag(gram) - np.sum(gram[:, always].T * absorbed, axis=0)
    told = left > settings.SETTINGS.least_information
    names = {column.effect for column in fit.law.columns if column.kind == "effect"}
    return {
        name for name in names if not any(told[j] for columns in fit.law.alternatives(name) for j in columns)
    }
