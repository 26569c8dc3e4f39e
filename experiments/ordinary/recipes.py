"""All recipes of ordinary records, by the row of the table."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from experiments.ordinary.clean_records import CLEAN
from experiments.ordinary.converted_records import CONVERTED
from experiments.ordinary.disturbed_records import DISTURBED
from experiments.ordinary.filtered_records import FILTERED
from experiments.ordinary.fluctuating_records import FLUCTUATING
from experiments.ordinary.rig import OrdinaryRecord

__all__ = ["RECIPES", "Recipe"]

Recipe = Callable[[np.random.Generator, int], OrdinaryRecord]
"""A record from a generator and its number within the row; what goes round goes by the number."""

RECIPES: Mapping[str, Recipe] = {**CLEAN, **FILTERED, **CONVERTED, **FLUCTUATING, **DISTURBED}
