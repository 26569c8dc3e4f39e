"""All recipes of ordinary records, by the row of the table."""

from __future__ import annotations

from collections.abc import Mapping

from experiments.ordinary.clean_records import CLEAN
from experiments.ordinary.converted_records import CONVERTED
from experiments.ordinary.disturbed_records import DISTURBED
from experiments.ordinary.filtered_records import FILTERED
from experiments.ordinary.fluctuating_records import FLUCTUATING
from experiments.ordinary.resisted_records import RESISTED
from experiments.ordinary.rig import Recipe

__all__ = ["RECIPES"]

RECIPES: Mapping[str, Recipe] = {**CLEAN, **FILTERED, **CONVERTED, **FLUCTUATING, **RESISTED, **DISTURBED}
