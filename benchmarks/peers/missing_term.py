"""The effect that the law of dry friction lacks: ``close-loop`` next to sparse regression, on sealed records.

The records are those of :mod:`experiments.blind` that sparse regression can be given: displacements and
angles, under no effect or forces of its library. Friction that differs by direction is a shift of the sensor
in these, exactly, and is not drawn alone.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import friction_bayes as fb
from benchmarks.peers.errors import ERRORS, TIMES, errors_and_times
from benchmarks.peers.measuring import bold, table, timed
from benchmarks.peers.weak_form import LIBRARY, Coefficients, WeakForm, weak_form
from experiments.blind.draws import FORCE_EFFECTS
from experiments.blind.generator import draw
from experiments.blind.scoring import score, set_name
from experiments.blind.sealed import SealedRecord
from experiments.loop_blind import REFUSED
from friction_bayes.decay.free_decay import find_free_decay

PACKAGES = ("pysindy", "scikit-learn", "scipy", "numpy")
KINDS = (
    "plain_coulomb",
    *(name for name in FORCE_EFFECTS if name != "asymmetric_friction"),
    "two_forces",
)
EACH = 6
SEED = 20261126
OURS = "close-loop"

EFFECTS = {
    "1": "asymmetric_friction",
    "v": "viscous_damping",
    "v|v|": "quadratic_drag",
    "x^3": "cubic_stiffness",
    "t sign(v)": "friction_drift",
    "exp(-(v/0.1)^2) sign(v)": "stribeck_friction",
    "exp(-(v/0.3)^2) sign(v)": "stribeck_friction",
}
"""What a term of the library means."""
PICKS: dict[str, Callable[[WeakForm], Coefficients]] = {
    "PySINDy, best subset": WeakForm.best_subset,
    "PySINDy, thresholded": WeakForm.thresholded,
}


def records() -> Iterator[SealedRecord]:
    """As many of each kind."""
    for kind in KINDS:
        seeds, kept = iter(range(1000)), 0
        while kept < EACH:
            sealed = draw(kind, np.random.SeedSequence([SEED, KINDS.index(kind), next(seeds)]))
            if sealed.truth.quantity != "acceleration":
                kept += 1
                yield sealed


def effects_of(coefficients: Coefficients) -> str:
    """The set of effects that some terms mean."""
    return set_name({EFFECTS[name] for name in coefficients if name in EFFECTS})


def _loop(sealed: SealedRecord) -> dict[str, Any]:
    system = fb.Oscillator(**sealed.system)
    try:
        report = fb.close_loop([sealed.record], system, seed=1, check=False).to_dict()
    except fb.InputError:
        report = REFUSED
    return score(sealed.truth.visible, sealed.truth.friction, report)


def judged(sealed: SealedRecord) -> dict[str, tuple[float, bool, float]]:
    """By method, seconds, whether the set is the true one, and the relative error of friction."""
    spent, score = timed(lambda: _loop(sealed))
    found = {OURS: (spent, bool(score["right"]), score["error_after"])}
    system, truth = fb.Oscillator(**sealed.system), sealed.truth
    spent, form = timed(lambda: weak_form(find_free_decay(sealed.record, system), LIBRARY))
    for name, pick in PICKS.items():
        more, terms = timed(lambda pick=pick: pick(form))
        right = effects_of(terms) == set_name(truth.visible)
        found[name] = (spent + more, right, form.friction(terms) / truth.friction - 1.0)
    return found


def compare() -> list[str]:
    """The table of the page."""
    sealed = list(records())
    with warnings.catch_warnings():
        # what a method is not sure of shows in its errors here
        warnings.simplefilter("ignore")
        judged(sealed[0])
        found = [judged(each) for each in sealed]
    columns = {name: list(zip(*(each[name] for each in found), strict=True)) for name in (OURS, *PICKS)}
    times, rights, errors = ({name: each[k] for name, each in columns.items()} for k in range(3))
    texts = errors_and_times(errors, times, [OURS])
    rows = [
        [name, bold(f"{sum(rights[name])} of {len(found)}", sum(rights[name]) > sum(rights[OURS])), *text]
        for name, text in texts.items()
    ]
    return table(("method", "sets found", *ERRORS, *TIMES), rows)
