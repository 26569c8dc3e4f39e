"""The reference: emcee on the very log-probability the closed form solves, as ArviZ reads it."""

from __future__ import annotations

from friction_bayes.reference.estimates import sample_reference
from friction_bayes.reference.inference_data import to_inference_data
from friction_bayes.reference.sampling import sample_target
from friction_bayes.reference.tree import load_tree, save_tree

__all__ = ["load_tree", "sample_reference", "sample_target", "save_tree", "to_inference_data"]
