"""Can the record distinguish its effects from others? Judged on the noise-free signal, by chi-square."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from experiments.blind.draws import CATALOGUE, EXCLUSIVE, OUTSIDE
from experiments.blind.fitting import Problem, fit_set, physical_parameters
from experiments.blind.generator import draw
from experiments.blind.outliers import deviance_of_outliers, deviance_with_outliers
from experiments.blind.sealed import SealedRecord

__all__ = ["IDENTIFIABLE_LOSS", "UNEXPLAINED_LOSS", "closest_rival", "problem_of", "sealed_record"]

IDENTIFIABLE_LOSS = 10.0
UNEXPLAINED_LOSS = 200.0

_SAMPLES_PER_PERIOD = 40.0
_STRONGER = 1.5
_MOST_REDRAWS = 12

Effects = frozenset[str]


def _candidates(size: int, losses: dict[Effects, float]) -> Iterator[Effects]:
    """Every set of at most ``size`` effects, small ones first; exclusive pairs are never together.

    Sets that extend the nearest of the smaller sets come first: a rival that is near enough to end the
    search is soon found.
    """
    for n in range(size + 1):
        sets = [frozenset(c) for c in combinations(CATALOGUE, n) if frozenset(c) not in EXCLUSIVE]
        yield from sorted(
            sets, key=lambda effects: min((losses[effects - {name}] for name in effects), default=0.0)
        )


def _contains(rival: Effects, truth: Effects) -> bool:
    """Whether a rival is the truth, or contains it as the case of a vanishing parameter.

    An offset that does not drift is a drift of rate zero: that is the truth and one parameter more, not
    another explanation.
    """
    still = {"sensor_offset" if name == "sensor_drift" else name for name in rival}
    return rival == truth or ("sensor_offset" in truth and still == truth)


def problem_of(sealed: SealedRecord, clipped: bool = False) -> Problem:
    """Thin the signal out where that loses nothing; leave flat samples aside where they are censored."""
    parameters = sealed.truth.parameters
    highest = max(parameters.get("interference_frequency", 1.0), parameters.get("mode_frequency", 1.0))
    stride = max(int(sealed.truth.samples_per_period / max(_SAMPLES_PER_PERIOD, 4.0 * highest)), 1)
    signal = sealed.clean[::stride]
    level = parameters.get("clipping_level", math.inf)
    return Problem(
        times=sealed.times[::stride],
        signal=signal,
        used=np.abs(signal) < level if clipped else np.ones(signal.size, dtype=bool),
        noise_sd=sealed.noise_sd,
        weight=float(stride),
        end=sealed.motion.law.duration,
        order=2 if sealed.truth.quantity == "acceleration" else 0,
        rest_time=sealed.rest_time,
    )


def _losses(sealed: SealedRecord, size: int) -> Iterator[tuple[Effects, float]]:
    """Chi-square that each rival of at most ``size`` effects loses to the truth, smallest sets first."""
    truth = sealed.truth
    guess = physical_parameters(
        frequency=sealed.frequency,
        friction=sealed.motion.law.friction,
        displacement=sealed.start[0],
        velocity=sealed.start[1],
    )
    real_outliers = "outliers" in truth.effects
    clipped = "sensor_clipping" in truth.effects
    fraction = truth.parameters.get("outlier_fraction", 0.0)
    scale = truth.parameters.get("outlier_scale", 1.0)
    problems = {flat: problem_of(sealed, flat) for flat in ({False, True} if clipped else {False})}
    fitted: dict[tuple[bool, Effects], NDArray[np.float64]] = {}
    chi_square: dict[tuple[bool, Effects], float] = {}
    losses: dict[Effects, float] = {}
    for effects in _candidates(size, losses):
        # where no sample is flat, or none far out, clipping and outliers add nothing to a rival
        censored = clipped and "sensor_clipping" in effects
        motion = effects - {"sensor_clipping", "outliers"}
        key = (censored, motion)
        problem = problems[censored]
        if key not in fitted:
            bases = {known: p for (flat, known), p in fitted.items() if flat == censored}
            chi_square[key], fitted[key] = fit_set(problem, motion, bases, guess)
        loss = chi_square[key]
        if "outliers" in effects and not real_outliers:
            ratio = problem.residual(fitted[key])[problem.used] / math.sqrt(problem.weight)
            loss = min(loss, deviance_with_outliers(ratio, problem.weight))
        elif real_outliers:
            # an outlying sample has next to no information about the motion
            loss *= 1.0 - fraction
            if "outliers" not in effects:
                loss += deviance_of_outliers(sealed.times.size, fraction, scale)
        losses[effects] = loss
        if not _contains(effects, frozenset(truth.visible)):
            yield effects, loss


def closest_rival(sealed: SealedRecord, size: int, *, enough: float = 0.0) -> tuple[float, Effects]:
    """Lowest chi-square loss among the rivals of at most ``size`` effects.

    Parameters
    ----------
    sealed : SealedRecord
        With its truth, which is no rival of itself.
    size : int
        Most effects a rival may have.
    enough : float
        Stop at the first rival that loses less than this.

    Returns
    -------
    loss : float
        Infinite where there is no rival (a plain record has none of no more effects).
    rival : frozenset of str
        Who.
    """
    best: tuple[float, Effects] = (math.inf, frozenset())
    for effects, loss in _losses(sealed, size):
        if loss < best[0]:
            best = (loss, effects)
        if loss < enough:
            break
    return best


def sealed_record(kind: str, seed: np.random.SeedSequence | int) -> tuple[SealedRecord, float, Effects]:
    """Draw a record and say how near its closest rival comes.

    Returns
    -------
    sealed : SealedRecord
        The record. One outside the catalogue is drawn stronger, by half each time, until every set of
        up to two catalogue effects loses at least 200; others stay as they are drawn.
    loss : float
        Chi-square lost by the closest rival of no more effects (outside the catalogue: of up to two);
        by the first one found where a rival loses too little.
    rival : frozenset of str
        That rival.
    """
    if kind not in OUTSIDE:
        sealed = draw(kind, seed)
        return sealed, *closest_rival(sealed, len(sealed.truth.visible), enough=IDENTIFIABLE_LOSS)
    for attempt in range(_MOST_REDRAWS):
        sealed = draw(kind, seed, strength=_STRONGER**attempt)
        loss, rival = closest_rival(sealed, 2, enough=UNEXPLAINED_LOSS)
        if loss >= UNEXPLAINED_LOSS:
            return sealed, loss, rival
    raise RuntimeError(
        f"{kind}: the catalogue imitates it to {loss:.0f} even at {_STRONGER**attempt:.0f} times"
    )
