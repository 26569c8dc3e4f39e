"""Whatever acts, whatever sensor reads it and wherever it begins: close-loop ends in a report or a refusal.

A sample of what 1,000 records were read for (``FRICTION_BAYES_TEST_SEED`` draws others): every third effect
of the catalogue once, on a sensor drawn for it. Warnings are errors, so that none divides by zero on the way.
"""

from __future__ import annotations

import json

import numpy as np
import pytest

import friction_bayes as fb
from any_decay import any_decay
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.mechanics.effects import EFFECTS


@pytest.mark.filterwarnings("ignore::friction_bayes.RecordWarning")
@pytest.mark.parametrize("name", sorted(EFFECTS)[::3])
def test_any_effect_on_any_sensor(name: str, rng: np.random.Generator) -> None:
    for quantity in rng.permutation(list(QUANTITIES)):
        try:
            drawn = any_decay(name, quantity, rng)
        except fb.InputError:
            # no sensor of this quantity has it
            continue
        break
    try:
        report = fb.close_loop([drawn.record], drawn.system, seed=1)
    except fb.InputError:
        # what cannot be a decay, such as one cut at a hundredth of its swing
        return
    json.dumps(report.to_dict(), allow_nan=False)
    assert sum(c["probability"] for c in report.candidates) == pytest.approx(1.0), drawn.what
