"""The commands of ``friction-bayes``, one module each: ``add_parser(commands)`` and ``run(arguments)``."""

from __future__ import annotations

from friction_bayes.commands import datasets, demo, estimate, simulate

__all__ = ["COMMANDS"]

COMMANDS = (demo, estimate, simulate, datasets)
