"""Forecast error: a model is fitted anew to the first part of the record and compared over the rest."""

from __future__ import annotations

import math

from friction_bayes.loop.fit import LoopFit, fit_growing_record, fit_model

__all__ = ["FITTED_SHARE", "FORECAST", "forecast_error"]

FITTED_SHARE = 0.7
FORECAST = (
    "root mean square error over the last 30 % of the moving record of each model, "
    "fitted anew to the first 70 %; the noise floor is the residual of the final fit to all of it"
)


def forecast_error(fit: LoopFit) -> float:
    """RMS error over the rest of the moving records after a fit to their first 70 %; nan if that fails."""
    model = fit.model
    heads = [int(FITTED_SHARE * segment.moving) for segment in model.segments]
    first = model.of_first_samples(heads)
    # a part that is too short for the effects leads astray; from the law of all, a cycle may slip
    tried = (
        fit_growing_record(first, fit.noise_models, fit.z, share=0.5),
        fit_model(first, fit.noise_models, fit.z),
    )
    again = min((one for one in tried if one is not None), key=lambda one: one.objective, default=None)
    if again is None:
        return math.nan
    total, count = 0.0, 0
    for r, (segment, head) in enumerate(zip(model.segments, heads, strict=True)):
        prediction = model.predict(again.z, r)
        if prediction is None:
            return math.nan
        used = segment.sides == 0.0
        used[:head] = False
        used[segment.moving :] = False
        error = (segment.values - prediction.signal)[used]
        total += float(error @ error)
        count += error.size
    return math.sqrt(total / count) if count else math.nan
