"""Friction of a plain decay: ``waveform`` next to least squares, a decrement and sparse regression."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import xarray as xr

import friction_bayes as fb
from benchmarks.peers.errors import ERRORS, TIMES, errors_and_times, friction_or_inf
from benchmarks.peers.measuring import table, timed
from benchmarks.peers.weak_form import LAW, LIBRARY, WeakForm, weak_form
from experiments.classical import CLASSICAL
from friction_bayes.decay.free_decay import FreeDecay, find_free_decay
from friction_bayes.mechanics.testbed import PAPER_RELEASE, PAPER_SYSTEM

PACKAGES = ("lmfit", "pysindy", "scikit-learn", "scipy", "numpy")
RECORDS = 100
NOISES = (5e-5, 5e-4, 1.6e-3)
"""Of a sample [m]; the same records under each."""
DURATION, RATE = 33.0, 200.0
LEAST, MOST = 0.03, 0.15
"""Friction is drawn log-uniformly between them [N]."""
OURS = WHITE, DEFAULT, BATCH = "waveform, white noise", "waveform", "waveform, in a batch"
"""The first is for what least squares takes the noise; the others look for a random force too."""
TERMS = {name: LIBRARY[name] for name in (*LAW, "1", "v", "v|v|")}

PICKS: dict[str, Callable[[WeakForm], dict[str, float]]] = {
    "PySINDy, the law known": lambda form: form.of([*LAW, "1"]),
    "PySINDy, best subset": WeakForm.best_subset,
}


def record(seed: int, noise: float) -> tuple[xr.DataArray, float]:
    """A decay of the paper's oscillator from anywhere in its cycle, and its friction."""
    rng = np.random.default_rng(seed)
    friction = LEAST * (MOST / LEAST) ** rng.random()
    angle = rng.uniform(0.0, 2.0 * math.pi)
    speed = PAPER_RELEASE * PAPER_SYSTEM.natural_frequency
    decay = fb.simulate(
        PAPER_SYSTEM,
        friction=friction,
        initial_displacement=PAPER_RELEASE * math.cos(angle),
        initial_velocity=-speed * math.sin(angle),
        duration=DURATION,
        sampling_rate=RATE,
        noise_sd=noise,
        seed=seed,
    )
    return decay, friction


def _decay(data: xr.DataArray) -> FreeDecay:
    """The moving part, which all but ours are given."""
    return find_free_decay(data, PAPER_SYSTEM)


METHODS: dict[str, Callable[[xr.DataArray], float]] = {
    DEFAULT: lambda data: float(fb.estimate(data, PAPER_SYSTEM).friction.mean()),
    WHITE: lambda data: float(fb.estimate(data, PAPER_SYSTEM, random_force="none").friction.mean()),
    "lmfit": lambda data: CLASSICAL["least squares (lmfit)"](_decay(data)).friction,
    "Feeny-Liang": lambda data: CLASSICAL["Feeny-Liang decrement"](_decay(data)).friction,
}


def estimates(data: xr.DataArray) -> dict[str, tuple[float, float]]:
    """By method, seconds and friction, infinite where it refuses."""
    found = {name: timed(partial(friction_or_inf, partial(work, data))) for name, work in METHODS.items()}
    spent, form = timed(lambda: weak_form(_decay(data), TERMS))
    for name, pick in PICKS.items():
        more, friction = timed(lambda pick=pick: form.friction(pick(form)))
        found[name] = (spent + more, friction)
    return found


def in_a_batch(data: Sequence[xr.DataArray]) -> list[tuple[float, float]]:
    """Of each record seconds and friction, infinite where it is refused."""
    values = np.stack([each.values for each in data])
    spent, found = timed(lambda: fb.estimate_batch(values, PAPER_SYSTEM, sampling_rate=RATE))
    frictions = np.where(np.isfinite(found["friction_mean"]), found["friction_mean"], np.inf)
    return [(spent / len(data), float(friction)) for friction in frictions]


def compare() -> list[str]:
    """The table of the page."""
    rows = []
    for noise in NOISES:
        with warnings.catch_warnings():
            # what a method is not sure of shows in its errors here
            warnings.simplefilter("ignore")
            first, _ = record(0, noise)
            in_a_batch([first])
            estimates(first)
            data, truths = zip(*(record(seed, noise) for seed in range(1, RECORDS + 1)), strict=True)
            found = [
                estimates(each) | {BATCH: alike} for each, alike in zip(data, in_a_batch(data), strict=True)
            ]
        errors, times = {}, {}
        for name in found[0]:
            spent, frictions = zip(*(each[name] for each in found), strict=True)
            errors[name] = np.array(frictions) / truths - 1.0
            times[name] = spent
        texts = errors_and_times(errors, times, OURS)
        rows += [[f"{1e3 * noise:g}", name, *text] for name, text in texts.items()]
    return table(("noise [mm]", "method", *ERRORS, *TIMES), rows)
