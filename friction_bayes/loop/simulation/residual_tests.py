"""Tests of whether the residual is noise, in every channel where an effect can show.

Each channel is a set of template signals. With the templates' inner products ``b`` with the standardised
residual, and ``S`` their Gram matrix after what the fit has absorbed is projected out, ``b' S^-1 b`` is chi
square with one degree of freedom a template if the residual is noise. The rest are textbook tests
(Ljung-Box, the largest line of a periodogram, the count of far residuals). All p-values are
corrected for the number of channels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats
from scipy.linalg import cho_factor, cho_solve

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.decay.whiteness import whiteness
from friction_bayes.loop import settings
from friction_bayes.loop.simulation.fit import LoopFit

__all__ = [
    "Channel",
    "ResidualTests",
    "far_residuals",
    "largest_line",
    "residual_tests",
    "standardised_residual",
]


_THIRDS = 3
_FEWEST_FOR_A_LINE = 4
"""Samples that have a frequency between zero and Nyquist's: of a record that clips none may be left."""
_SILENT = 0.5
"""Root mean square of standardised residuals that are far below the least noise."""


@dataclass(frozen=True)
class Channel:
    """One test.

    Attributes
    ----------
    name : str
    statistic : float
    degrees : int
        Degrees of freedom, or samples of a count.
    p_value : float
        Before correction.
    """

    name: str
    statistic: float
    degrees: int
    p_value: float


@dataclass(frozen=True)
class ResidualTests:
    """All tests of a fit.

    Attributes
    ----------
    channels : tuple of Channel
    rms : float
        Of the residual where the sensor is within its range, unit of the signal.
    """

    channels: tuple[Channel, ...]
    rms: float

    @property
    def failed(self) -> tuple[str, ...]:
        """Names of the channels that fail."""
        level = settings.SETTINGS.false_alarm_rate / max(len(self.channels), 1)
        return tuple(c.name for c in self.channels if c.p_value < level)

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "rms": self.rms,
            "passes": not self.failed,
            "failed": list(self.failed),
            "false_alarm_rate": settings.SETTINGS.false_alarm_rate,
            "channels": {
                c.name: {"statistic": c.statistic, "degrees": c.degrees, "p_value": c.p_value}
                for c in self.channels
            },
        }


def standardised_residual(fit: LoopFit, r: int) -> tuple[Array, Mask]:
    """Whitened residual over its standard deviation, and which samples are free of the sensor's ends.

    Near an end of the range the residuals are those of a cut distribution. Over the censored samples
    and these together their generalised residuals still sum to zero, so that the templates may use them.
    """
    noise, segment = fit.noises[r], fit.model.segments[r]
    # with outliers the weight is what the contaminated normal gives the sample
    e = noise.residual * np.sqrt(noise.weight)
    free = noise.weight > 0.0
    if fit.noise_models[r].censored:
        free &= segment.free
        reach = fit.predictions[r].signal
        for side in (1.0, -1.0):
            held = segment.values[segment.sides == side]
            if held.size:
                free &= side * reach < side * held[0] - settings.SETTINGS.far * noise.sd
    return e, free


def residual_tests(fit: LoopFit) -> ResidualTests:
    """Tests of the residual of a fit."""
    residuals = [standardised_residual(fit, r) for r in range(len(fit.noises))]
    channels = [*_template_channels(fit, residuals), *_noise_channels(fit, residuals), _saturation(fit)]
    everything = np.concatenate(fit.free_residuals)
    return ResidualTests(tuple(channels), float(np.sqrt(np.mean(everything**2))))


def _noise_channels(fit: LoopFit, residuals: list[tuple[Array, Mask]]) -> list[Channel]:
    """Tests that the residual is white and normal: correlation, the largest line, samples far out."""
    lines, correlated, plain = [], [], []
    for r, (e, used) in enumerate(residuals):
        x = e[used]
        if float(x @ x) < _SILENT**2 * x.size:
            # a record without noise: the residual is the integrator's error
            x = np.zeros(x.size)
        correlated.append(whiteness(x))
        lines.append(largest_line(x))
        plain.append(fit.noises[r].residual[used] / fit.noises[r].sd)
    lags = sum(w.lags for w in correlated)
    total = math.fsum(w.statistic for w in correlated)
    peak = min(lines, key=lambda line: line[1])
    channels = [
        Channel("whiteness", total, lags, float(stats.chi2.sf(total, lags))),
        Channel("spectrum", peak[0], 2, min(1.0, peak[1] * len(lines))),
    ]
    if not any(noise_model.outliers for noise_model in fit.noise_models):
        channels.append(far_residuals(np.concatenate(plain)))
    return channels


def far_residuals(x: Array) -> Channel:
    """Test of the tails: the number of far residuals, and whether one dwarfs all others.

    Parameters
    ----------
    x : ndarray, shape (n,)
        White residuals over their standard deviation.
    """
    count = int(np.count_nonzero(np.abs(x) > settings.SETTINGS.far))
    p_value = float(stats.binom.sf(count - 1, x.size, 2.0 * stats.norm.sf(settings.SETTINGS.far)))
    largest = float(np.max(np.abs(x), initial=0.0))
    if largest**2 > settings.SETTINGS.minor_share * float(x @ x):
        p_value = min(p_value, 2.0 * x.size * float(stats.norm.sf(largest)))
    return Channel("tails", float(count), x.size, p_value)


def _saturation(fit: LoopFit) -> Channel:
    """Samples held at an end of the sensor's range that the fit does not censor."""
    pairs = zip(fit.model.segments, fit.noise_models, strict=True)
    flat = sum(int(np.count_nonzero(s.sides)) for s, noise in pairs if not noise.censored)
    return Channel("saturation", float(flat), 1, 0.0 if flat else 1.0)


def _template_channels(fit: LoopFit, residuals: list[tuple[Array, Mask]]) -> list[Channel]:
    factor = cho_factor(fit.precision)
    sums: dict[str, tuple[float, int]] = {}
    # the remaining step of the climb: a template close to the fit's own space would show it
    gradient = -np.array([c.precision for c in fit.model.coordinates]) * fit.z
    for (e, _), jacobian, noise in zip(residuals, fit.jacobians, fit.noises, strict=True):
        gradient += jacobian.T @ (np.sqrt(noise.weight) * e)
    unclimbed = cho_solve(factor, gradient)
    for r, (e, _) in enumerate(residuals):
        root = np.sqrt(fit.noises[r].weight)
        for name, columns in _templates(fit, r).items():
            scaled = columns * root[:, None]
            norm = np.sqrt((scaled**2).sum(axis=0))
            scaled = scaled[:, norm > 1e-9 * max(float(norm.max(initial=0.0)), 1e-300)]
            if scaled.shape[1] == 0:
                continue
            scaled = scaled / np.sqrt((scaled**2).sum(axis=0))
            jacobian = fit.jacobians[r] * root[:, None]
            shared = jacobian.T @ scaled
            gram = scaled.T @ scaled - shared.T @ cho_solve(factor, shared)
            values, vectors = np.linalg.eigh(0.5 * (gram + gram.T))
            kept = values > settings.SETTINGS.minor_share
            b = vectors[:, kept].T @ (scaled.T @ e - shared.T @ unclimbed)
            statistic, degrees = sums.get(name, (0.0, 0))
            sums[name] = (statistic + float(np.sum(b * b / values[kept])), degrees + int(kept.sum()))
    return [Channel(k, s, d, float(stats.chi2.sf(s, d))) for k, (s, d) in sums.items() if d]


def _templates(fit: LoopFit, r: int) -> dict[str, Array]:
    segment, prediction = fit.model.segments[r], fit.predictions[r]
    time, n = segment.time, segment.values.size
    moving = time < prediction.stop_time
    end = max(int(np.count_nonzero(moving)), 1)
    share = np.minimum(np.arange(n) / end, 1.0 - 1e-9)
    turns, bins = prediction.turning_times, settings.SETTINGS.bins
    centres = _binned(np.ones(n), np.arange(n) / n, _THIRDS * bins)
    if turns.size < 2:
        return {"centres": centres}
    half = np.clip(np.searchsorted(turns, time, side="right") - 1, 0, turns.size - 2)
    fraction = np.clip((time - turns[half]) / (turns[half + 1] - turns[half]), 0.0, 1.0 - 1e-9)
    before = time < turns[0]
    # a start in mid-motion: count back from the first turning point at the pace of the first half cycle
    fraction[before] = np.clip(1.0 - (turns[0] - time[before]) / (turns[1] - turns[0]), 0.0, 1.0 - 1e-9)
    cell = np.floor(fraction * bins) + bins * (prediction.direction > 0.0)
    cell += 2 * bins * np.floor(share * _THIRDS)
    phase = np.zeros((n, 2 * bins * _THIRDS))
    phase[np.arange(n), cell.astype(int)] = moving
    swing = prediction.clean * moving
    found = {
        "phase": phase,
        "turning_points": _binned(swing, share, bins),
        "half_periods": _binned(np.gradient(prediction.clean, time) * moving, share, bins),
        "centres": centres,
        "direction": _binned(prediction.direction * moving, share, bins),
    }
    if not moving.all():
        found["rest"] = (~moving).astype(float)[:, None]
    return found


def _binned(column: Array, share: Array, bins: int) -> Array:
    """One template a stretch of time."""
    out = np.zeros((column.size, bins))
    out[np.arange(column.size), (share * bins).astype(int)] = column
    return out


def largest_line(x: Array) -> tuple[float, float]:
    """Largest ordinate of the periodogram over their mean, and its p-value (Fisher)."""
    if x.size < _FEWEST_FOR_A_LINE:
        return 0.0, 1.0
    power = np.abs(np.fft.rfft(x - x.mean())[1:-1]) ** 2
    mean = float(power.mean())
    if mean == 0.0:
        return 0.0, 1.0
    g = float(power.max()) / mean
    return g, float(-np.expm1(power.size * np.log1p(-math.exp(-g)))) if g > 1e-9 else 1.0
