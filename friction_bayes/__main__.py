"""``python -m friction_bayes``."""

from __future__ import annotations

import sys

from friction_bayes.cli.program import command

if __name__ == "__main__":
    sys.exit(command())
