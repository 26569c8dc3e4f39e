"""Forecast of the rest of a record by a model fitted to its first part alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.coulomb_fit import CoulombFit, refitted
from friction_bayes.loop.report.result import ForecastTrace, RecordTrace

__all__ = [
    "Forecast",
    "forecast_errors",
    "forecast_records",
    "held_out_error",
    "with_forecasts",
]

_WHAT = (
    "root mean square error over the last 30 % of the moving record of each model, "
    "fitted anew to the first 70 %; the noise floor is the residual of the final fit to all of it"
)
_BAND90 = 1.6448536269514722
"""Half width of the central 90 % of a normal distribution, in standard deviations."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Forecast:
    """The last part of a moving record, measured and predicted from the first part.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Seconds in the record.
    signal : ndarray, shape (n,)
        Measured.
    mean, sd : ndarray, shape (n,)
        Of the predictive distribution of the signal, noise of the sensor included.
    free : ndarray of bool, shape (n,)
        Samples that are not clipped: they are compared.
    """

    time: Array
    signal: Array
    mean: Array
    sd: Array
    free: Mask

    @classmethod
    def of(cls, segment: Segment, head: int, mean: Array, sd: Array) -> Forecast:
        """Of the moving samples after the first ``head``."""
        rest = slice(head, segment.moving)
        time = segment.decay.start_time + segment.time[rest]
        return cls(time=time, signal=segment.values[rest], mean=mean, sd=sd, free=segment.free[rest])

    @property
    def error(self) -> Array:
        """Measured minus predicted, of the samples that are compared."""
        return np.asarray((self.signal - self.mean)[self.free])


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
    """Error of the final model, and the share of the samples within its predictive 90 % band."""
    errors = _errors(after)
    sd = np.concatenate([np.empty(0), *(forecast.sd[forecast.free] for forecast in after)])
    inside = float(np.mean(np.abs(errors) <= _BAND90 * sd)) if errors.size else math.nan
    return {"after": _rms(errors), "inside90": inside}


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
    return tuple(
        replace(
            trace,
            forecast=ForecastTrace(
                time=final.time, signal=final.signal, before=coulomb.mean, after=final.mean, sd=final.sd
            ),
        )
        for trace, coulomb, final in zip(traces, before, after, strict=True)
    )
