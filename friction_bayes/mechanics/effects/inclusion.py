"""How probable every effect is before a record."""

from __future__ import annotations

import math

__all__ = ["INCLUSION", "PRIOR_LOG_ODDS"]

INCLUSION = 0.1
"""Prior probability that an effect acts, independently for each."""
PRIOR_LOG_ODDS = math.log(INCLUSION / (1.0 - INCLUSION))
"""Of one effect."""
