"""Regression of a free decay under a force that fluctuates."""

from friction_bayes.estimators.random_force.posterior import ForcePrior, Posterior, Problem, integrate
from friction_bayes.estimators.random_force.smoothing import Motion, first_motion

__all__ = ["ForcePrior", "Motion", "Posterior", "Problem", "first_motion", "integrate"]
