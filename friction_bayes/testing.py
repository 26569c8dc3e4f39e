"""Statistical unit tests for other people's suites."""

from __future__ import annotations

import os

__all__ = ["base_seed"]


def base_seed() -> int:
    """Return the one seed of a test suite: ``FRICTION_BAYES_TEST_SEED`` from the environment, or 20261121."""
    return int(os.environ.get("FRICTION_BAYES_TEST_SEED", "20261121"))
