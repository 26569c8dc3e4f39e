"""Forecast of the rest of a record: its law, its random force and the state at the end of the first part."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.estimators.random_force.transition import discretise
from friction_bayes.loop.forecast import FITTED_SHARE
from friction_bayes.loop.model import LoopModel, changes_signal
from friction_bayes.loop.parameters import FRICTION, LOG_FREQUENCY_RATIO
from friction_bayes.loop.random_force.draws import LawDraws, law_draws
from friction_bayes.loop.random_force.fit import ForceFit, fit_random_force
from friction_bayes.mechanics.effects.friction_drift import FRICTION_DRIFT
from friction_bayes.mechanics.effects.timing_jitter import TIMING_JITTER

__all__ = ["Forecast", "forecast"]

_DRAWS = 40
"""Laws that are simulated: their scatter adds to a band that the random force makes for the most part."""


@dataclass(frozen=True, eq=False)
class Forecast:
    """A predicted rest of a record.

    Attributes
    ----------
    rms : float
        Root mean square error, unit of the signal.
    inside90 : float
        Share of the samples within the predictive 90 % band.
    """

    rms: float
    inside90: float


def forecast(fit: ForceFit, rng: np.random.Generator) -> Forecast | None:
    """Fit the first part of the record anew and forecast the rest; None where that fails."""
    segment = fit.segment
    head = int(FITTED_SHARE * segment.moving)
    allowed = tuple(dict.fromkeys(column.effect for column in fit.law.columns if column.effect))
    line = next((c.shape[0].value for c in fit.law.columns if c.parameter == "sine"), None)
    if fit.jitter is not None and fit.jitter.found:
        allowed = (*allowed, TIMING_JITTER.name)
    first = fit_random_force(segment, fit.system, allowed, line=line, samples=head)
    if first is None:
        return None
    time = segment.time[head - 1 : segment.moving]
    draws = law_draws(first, rng, _DRAWS)
    signals = [_simulated(draws, k, time) for k in range(_DRAWS)]
    laws = np.array([signal for signal in signals if signal is not None])
    if laws.size == 0:
        return None
    shift, variance = _fluctuation(first, time)
    middle = laws.mean(axis=0) + shift
    noise = first.posterior.noise_sd * first.unit
    if first.jitter is not None and first.jitter.found:
        # the rate over the unit of phase, in which the jitter is given
        noise = noise * np.hypot(1.0, first.jitter.ratio / first.unit * np.gradient(middle, first.w0 * time))
    sd = np.sqrt(laws.var(axis=0) + variance + noise**2)
    used = segment.sides[head : segment.moving] == 0.0
    error = (segment.values[head : segment.moving] - middle[1:])[used]
    if error.size == 0:
        return None
    reach = 1.6448536269514722 * sd[1:][used]
    return Forecast(rms=float(np.sqrt(np.mean(error**2))), inside90=float(np.mean(np.abs(error) <= reach)))


def _simulated(draws: LawDraws, k: int, time: Array) -> Array | None:
    """Signal of one draw's law from the filtered state on."""
    fit = draws.fit
    names = fit.sets.effects[draws.chosen[k]]
    only = np.zeros(draws.friction.size, dtype=bool)
    only[k] = True
    values = {
        (name, parameter): float(value[0])
        for name in names
        for parameter, value in draws.parameters(name, only).items()
    }
    friction = float(draws.friction[k])
    drift = (FRICTION_DRIFT.name, FRICTION_DRIFT.parameters[0].name)
    if drift in values:
        # the simulated clock starts at the forecast, that of the drift with the record
        level = 1.0 + values[drift] * (time[0] - fit.segment.time[0]) / fit.duration
        friction, values[drift] = friction * level, values[drift] / level
    model = LoopModel(fit.system, (fit.segment,)).with_effects([n for n in names if changes_signal(n)])
    ratio = fit.w0 / fit.system.natural_frequency * math.sqrt(max(1.0 + draws.stiffness[k], 0.25))
    values |= {("", FRICTION): friction, ("", LOG_FREQUENCY_RATIO): math.log(ratio)}
    z = np.array(
        [
            c.coordinate(values[c.effect, c.name]) if (c.effect, c.name) in values else c.start
            for c in model.coordinates
        ]
    )
    x, v = fit.motion.states[-1, :2]
    prediction = model.predict_at(z, 0, time, (float(x), float(v) * fit.w0))
    return None if prediction is None else prediction.signal


def _fluctuation(fit: ForceFit, time: Array) -> tuple[Array, Array]:
    """What the random force adds to the signal from the last state on: mean and variance, shape (n,)."""
    best = fit.posterior.best
    transition, covariance = np.empty((3, 3)), np.empty((3, 3))
    step = float(np.median(np.diff(time))) * fit.w0
    discretise(step, 0.0, best.tau, transition, covariance)
    state = np.array([0.0, 0.0, fit.motion.states[-1, 2]])
    spread = fit.motion.covariance[-1].copy()
    force = (best.ratio * best.noise) ** 2
    mean, variance = np.empty(time.size), np.empty(time.size)
    for i in range(time.size):
        mean[i] = fit.row @ state
        variance[i] = fit.row @ spread @ fit.row
        state = transition @ state
        spread = transition @ spread @ transition.T + force * covariance
    return mean * fit.unit, variance * fit.unit**2
