"""The rest of a record forecast from its first part: by Coulomb friction alone, by all laws, and the errors.

A law is drawn with its random force and the state at the end of the first part.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.summary import HALF_WIDTH90
from friction_bayes.estimators.noise.free_corners import corners_after
from friction_bayes.estimators.noise.recording_filters import Through, determined, margin
from friction_bayes.loop import settings
from friction_bayes.loop.columns.effect_columns import OF_LINES
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import FRICTION, LOG_FREQUENCY_RATIO
from friction_bayes.loop.infer.coulomb_fit import CoulombFit, refitted
from friction_bayes.loop.infer.law_draws import LEAST_PROBABILITY, LawDraws, draw_laws
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.infer.record_fit import ForceFit, fit_first_part
from friction_bayes.loop.report.result import Forecast, RecordTrace
from friction_bayes.mechanics.effects import in_catalogue_order
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.statespace.kalman import sensor_row, smooth
from friction_bayes.statespace.measured_path import stiffness_along
from friction_bayes.statespace.regression import frequency_change
from friction_bayes.statespace.transition import distinct_steps, transition_table

__all__ = ["forecast", "forecast_errors", "forecast_records", "held_out_error", "with_forecasts"]

_WHAT = (
    "root mean square error over the last 30 % of the moving record of each model, "
    "fitted anew to the first 70 %; the noise floor is the residual of the final fit to all of it"
)
_DRAWS = 100
"""Laws that are simulated: their scatter adds to a band that is mostly due to the random force."""


def forecast_records(fit: CoulombFit) -> tuple[Forecast, ...]:
    """The rest of each moving record by Coulomb friction, fitted anew to the first 70 %.

    At the posterior mode, without a band, which is not reported. Empty where the fit fails.
    """
    model, forecasts = fit.model, []
    heads = [int(settings.SETTINGS.fitted_share * segment.moving) for segment in model.segments]
    again = refitted(model.of_first_samples(heads), fit.z, 0.5)
    if again is None:
        return ()
    for r, (segment, head) in enumerate(zip(model.segments, heads, strict=True)):
        predicted = model.predict(again.z, r)
        if predicted is None:
            return ()
        rest = slice(head, segment.moving)
        forecasts.append(Forecast.of(segment, head, predicted.signal[rest], np.zeros(segment.moving - head)))
    return tuple(forecasts)


def held_out_error(
    before: Sequence[Forecast], after: Sequence[Forecast], noise_floor: float, unit: str
) -> dict[str, Any]:
    """Errors of both models over all records, as reported; nan where one could not forecast."""
    return {
        "before": _rms(_errors(before)),
        **forecast_errors(after),
        "noise_floor": noise_floor,
        "unit": unit,
        "what": _WHAT,
    }


def forecast_errors(after: Sequence[Forecast]) -> dict[str, float]:
    """Error of the final model, its Monte Carlo error, and the share of samples in its 90 % band."""
    errors = _errors(after)
    rms, spread = _rms(errors), math.sqrt(sum(forecast.monte_carlo for forecast in after))
    sd = np.concatenate([np.empty(0), *(forecast.sd[forecast.free] for forecast in after)])
    inside = float(np.mean(np.abs(errors) <= HALF_WIDTH90 * sd)) if errors.size else math.nan
    # of half the mean square, over the root of that
    mcse = spread / (2.0 * errors.size * rms) if errors.size and rms > 0.0 else math.nan
    return {"after": rms, "after_mcse": mcse, "inside90": inside}


def _errors(forecasts: Sequence[Forecast]) -> Array:
    """Those of all records."""
    return np.concatenate([np.empty(0), *(forecast.error for forecast in forecasts)])


def _rms(errors: Array) -> float:
    return math.sqrt(float(np.mean(errors**2))) if errors.size else math.nan


def with_forecasts(
    traces: Sequence[RecordTrace], before: Sequence[Forecast], after: Sequence[Forecast]
) -> tuple[RecordTrace, ...]:
    """Records with both models' forecasts of their last parts; unchanged where one could not forecast."""
    if not len(traces) == len(before) == len(after):
        return tuple(traces)
    pairs = zip(before, after, strict=True)
    return tuple(replace(trace, forecasts=both) for trace, both in zip(traces, pairs, strict=True))


def forecast(fit: ForceFit, effects: Sequence[str], rng: np.random.Generator) -> Forecast | None:
    """The rest of a record forecast from a fit of its first part alone; None where that fails.

    The forecast is the posterior predictive mean over all laws of some effects, each as probable as it is
    after the whole record: draws over their coefficients and, where there is one, sizes of the random force,
    each from the state at which its own law and force leave the first part.
    """
    segment = fit.segment
    head = int(settings.SETTINGS.fitted_share * segment.moving)
    if fit.knocks:
        # of a force that may act
        effects = (*effects, RANDOM_FORCE.name)
    first, filter_ = fit_first_part(fit, effects, head), fit.law.filter
    if first is None:
        return None
    time = segment.time[head - 1 : segment.moving]
    used = time.size
    if filter_ is not None:
        # which has not seen enough at the end
        step = segment.decay.step
        time = np.append(time, time[-1] + step * np.arange(1, margin(filter_.angle) + 1))
    draws = draw_laws(LawFit.of(first), rng, _DRAWS, _as_probable(first, fit)).first
    points, which = np.unique(draws.point, return_inverse=True)
    states, spreads = _last_states(draws, points, which)
    simulated = [_simulated(draws, k, states[k, :2], time) for k in range(_DRAWS)]
    finite = np.array([motion is not None for motion in simulated])
    if not finite.any():
        return None
    motions = np.array([motion for motion in simulated if motion is not None])
    laws = motions[:, 0]
    if filter_ is not None:
        laws += _filtered(draws, finite, motions[:, 1:], time)
    slopes: tuple[Array | None, Array | None] = None, None
    if first.record.system.pendulum:
        x, v = motions[:, 1:].mean(axis=0)
        slopes = stiffness_along(first.w0 * time, x, v / first.w0)
    shifts, variances = _fluctuation(first, points, states[:, 2], which, spreads, time, *slopes)
    laws += shifts[finite]
    middle = laws.mean(axis=0)
    noise = np.full(middle.size, first.noise_sd)
    if first.growth is not None:
        about_rest = middle - segment.decay.rest_position
        grown = first.growth.effect.grows_with(about_rest, np.gradient(middle, time))
        noise = noise * np.hypot(1.0, first.growth.ratio / first.unit * grown)
    noise = first.sensor_noise.sd_of_samples(noise)
    sd = np.sqrt(laws.var(axis=0) + variances[which[finite]].mean(axis=0) + noise**2)
    return Forecast.of(segment, head, middle[1:used], sd[1:used], laws[:, 1:used])


def _as_probable(first: ForceFit, whole: ForceFit) -> Array | None:
    """Weights of the first part's cells, each law and force as probable as after the whole record.

    None where the first part rules these laws out.
    """
    weight = first.posterior.weight.copy()
    for forced in (False, True):
        points = (first.posterior.ratio > 0.0) == forced
        of_first, of_whole = (_of_effects(fit, forced=forced) for fit in (first, whole))
        weight[points] *= [of_whole[names] / max(of_first[names], LEAST_PROBABILITY) for names in first.sets]
    return weight / weight.sum() if weight.max() > LEAST_PROBABILITY else None


def _of_effects(fit: ForceFit, *, forced: bool) -> defaultdict[frozenset[str], float]:
    """Probability of each possible set of effects, with a random force or without."""
    probabilities: defaultdict[frozenset[str], float] = defaultdict(float)
    shares = fit.posterior.weight[(fit.posterior.ratio > 0.0) == forced].sum(axis=0) * ~fit.impossible
    for names, share in zip(fit.sets, shares.tolist(), strict=True):
        probabilities[names] += share
    return probabilities


def _last_states(draws: LawDraws, points: Integers, which: Integers) -> tuple[Array, Array]:
    """State after the first part under each draw, shape (k, 3), its covariance at each point, (g, 3, 3)."""
    fit = draws.fit
    regression = fit.regression
    states, spreads = np.empty((which.size, 3)), np.empty((points.size, 3, 3))
    for g, at in enumerate(points):
        mine = which == g
        laws = draws.coefficients[mine].T
        point = fit.posterior.points[at]
        residuals = regression.target[:, None] - regression.columns @ laws
        smoothed, covariance = smooth(residuals, fit.clock, regression.row, point.ratio, point.tau)
        states[mine] = smoothed[-1, :3].T
        states[mine, :2] += (regression.states[-1] @ laws + regression.known_states[-1][:, None]).T
        spreads[g] = covariance[-1, :3, :3] * point.noise**2
    return states, spreads


def _simulated(draws: LawDraws, k: int, state: Array, time: Array) -> Array | None:
    """Signal, displacement and velocity of one draw's law from a state on, shape (3, n)."""
    fit = draws.fit
    names = fit.sets[draws.set_index[k]] - set(OF_LINES)
    only = np.zeros(draws.friction.size, dtype=bool)
    only[k] = True
    values = {
        (name, parameter): float(value[0])
        for name in names
        for parameter, value in draws.parameters(name, only).items()
    }
    model = LoopModel(fit.record.system, (fit.segment,), in_catalogue_order(names))
    ratio = fit.w0 / fit.record.system.natural_frequency * frequency_change(draws.stiffness[k])
    values |= {("", FRICTION): float(draws.friction[k]), ("", LOG_FREQUENCY_RATIO): math.log(ratio)}
    (z,) = model.coordinates_of({key: [value] for key, value in values.items()}, 1)
    prediction = model.predict_at(z, 0, time, (float(state[0]), float(state[1]) * fit.w0))
    if prediction is None:
        return None
    return np.stack(
        [prediction.signal + _added(draws, k, time), prediction.displacement, prediction.velocity]
    )


def _filtered(draws: LawDraws, which: Mask, motions: Array, time: Array) -> Array:
    """The effect of the record's filter on forecasts, shape (k, n), that begin with the last fitted sample.

    Of the k draws ``which``, with displacements and velocities ``motions``, shape (k, 2, n).
    """
    fit, law = draws.fit, draws.fit.law
    before = np.stack([fit.path.x, fit.path.v * fit.w0])[:, :-1]
    past = np.broadcast_to(before, (len(motions), *before.shape))
    states = np.concatenate([past, motions], axis=2)
    when = np.append(fit.segment.time[: before.shape[1]], time)
    order = fit.segment.order
    motion = (states[:, order] if order < 2 else np.gradient(states[:, 1], when, axis=1)).T
    through, filter_ = Through(motion), law.filter
    assert filter_ is not None
    coefficients = draws.coefficients[which].T
    of_filter = np.array([column.kind == "filter" for column in law.columns])
    # what was unseen after the first part is forecast
    unseen, count = filter_.unseen(1).shape[1], len(filter_.doubts)
    doubts = through.doubts(filter_).reshape(len(motion), count, len(motions))
    shown = through(filter_)
    shown = shown + np.einsum("njk,jk->nk", doubts, coefficients[of_filter][unseen : unseen + count])
    # what it remembers is what the law of the first part has besides, whatever may have been before
    n, moved = before.shape[1], law.moved
    fitted = fit.unit * (law.sensor[:n, moved] @ coefficients[moved] + law.known[:n, None])
    memory, inside = filter_.memory(len(motion)), determined(filter_, n)
    shown = shown + memory @ np.linalg.lstsq(memory[:n][inside], (fitted - shown[:n])[inside])[0]
    return np.asarray((shown - motion)[before.shape[1] :].T)


def _added(draws: LawDraws, k: int, time: Array) -> Array:
    """What a sensor adds in one draw besides its effects, shape (n,): lines, zero within a step, corners."""
    fit = draws.fit
    signal = np.zeros(time.size)
    corners = draws.coefficients[k, [column.kind == "corner" for column in fit.law.columns]]
    if corners.size:
        signal += fit.unit * (corners_after(fit.path, fit.w0 * time) @ corners)
    for column, value in zip(fit.law.columns, draws.coefficients[k].tolist(), strict=True):
        if column.kind == "step":
            signal += value
        if column.line is not None and value:
            signal += value * column.line.waves(time)[column.parameter]
    return signal


def _fluctuation(
    fit: ForceFit,
    points: Integers,
    forces: Array,
    which: Integers,
    spreads: Array,
    time: Array,
    stiffness: Array | None,
    slope: Array | None,
) -> tuple[Array, Array]:
    """Means (k, n) and variances (g, n) of what the random force adds to the signal from the last state on.

    The force there is that of each draw, ``forces``, of one of the g ``points``, ``which``; ``spreads``,
    shape (g, 3, 3), are the covariances of that state. ``stiffness`` and ``slope`` are of a
    pendulum's restoring force along the forecast, see :func:`.stiffness_along`; None where they are one.
    """
    steps, stiffness, _, index = distinct_steps(time * fit.w0, stiffness)
    transitions, added = np.empty((2, steps.size, points.size, 3, 3))
    for g, at in enumerate(points):
        point = fit.posterior.points[at]
        transitions[:, g], added[:, g] = transition_table(steps, stiffness, point.tau)
        added[:, g] *= (point.ratio * point.noise) ** 2
    rows = np.broadcast_to(sensor_row(fit.segment.order, slope), (time.size, 3))
    unit_force = np.tile([0.0, 0.0, 1.0], (points.size, 1))
    responses, variances = np.empty((points.size, time.size)), np.empty((points.size, time.size))
    for i in range(time.size):
        if i > 0:
            step = transitions[index[i - 1]]
            unit_force = (step @ unit_force[:, :, None])[:, :, 0]
            spreads = step @ spreads @ step.transpose(0, 2, 1) + added[index[i - 1]]
        responses[:, i] = unit_force @ rows[i]
        variances[:, i] = rows[i] @ spreads @ rows[i]
    return forces[:, None] * responses[which] * fit.unit, variances * fit.unit**2
