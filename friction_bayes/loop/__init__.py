"""Closing the loop: from the residual of the Coulomb model to the effect it lacks, with its probability."""

from __future__ import annotations

from friction_bayes.loop.pipeline import close_loop
from friction_bayes.loop.report.result import LoopReport, RecordTrace

__all__ = ["LoopReport", "RecordTrace", "close_loop"]
