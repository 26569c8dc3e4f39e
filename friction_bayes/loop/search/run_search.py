"""The search of some records, with white noise and with coloured noise where the residual asks for it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.free_decay import no_decay_fits
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.data.starting_point import starting_point
from friction_bayes.loop.noise.autoregression import fit_autoregression, is_coloured
from friction_bayes.loop.noise.likelihood import LEAST_NOISE, NoiseModel
from friction_bayes.loop.search.candidate import SearchResult
from friction_bayes.loop.search.fit import LoopFit, fit_growing_record
from friction_bayes.loop.search.laplace_evidence import posterior_probabilities
from friction_bayes.loop.search.search import Search
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = ["coulomb_model", "search_records"]


def search_records(
    system: Oscillator,
    segments: tuple[Segment, ...],
    allowed: tuple[str, ...],
    noise: str,
    progress: Callable[[str], None] | None,
) -> SearchResult:
    """Search with white noise, and again with autoregressive noise where that is chosen.

    Parameters
    ----------
    system : Oscillator
    segments : tuple of Segment
    allowed : tuple of str
        Effects that may be tried.
    noise : {"auto", "white", "ar"}
    progress : callable, optional
        Called with the name of each set of effects that is fitted.

    Raises
    ------
    InputError
        If no Coulomb decay can be fitted.
    """
    ar = tuple(np.zeros(0) for _ in segments)
    search = Search(system, segments, allowed, ar, progress)
    _run(search)
    trail = search.trail
    first = search.ranked()[0].fit
    residuals = first.residuals
    # what is left of a record without noise is rounding, which no autoregression describes
    audible = any(each.sd > LEAST_NOISE * first.model.scales.signal for each in first.noises)
    if audible and (noise == "ar" or (noise == "auto" and _any_coloured(segments, residuals))):
        ar = _shared_autoregression(segments, residuals)
        order = max(a.size for a in ar)
        # an outlier spoils as many innovations as the order, which a contaminated normal does not describe
        kept = tuple(name for name in allowed if name != OUTLIERS.name)
        white, search = search, Search(system, segments, kept, ar, progress)
        search.start_from(white)
        _run(search)
        trail = [*trail, f"noise is autoregressive of order {order}: searched again", *search.trail]
    return _result(search, tuple(trail), first)


def _run(search: Search) -> None:
    search.run()
    if not search.candidates:
        names = ", ".join(s.decay.name for s in search.segments)
        raise no_decay_fits(names, search.system)


def _any_coloured(segments: tuple[Segment, ...], residuals: Sequence[Array]) -> bool:
    pairs = zip(segments, residuals, strict=True)
    return any(is_coloured(e, s.decay.step, s.decay.frequency) for s, e in pairs)


def _shared_autoregression(segments: tuple[Segment, ...], residuals: Sequence[Array]) -> tuple[Array, ...]:
    """One autoregression for all records of one sampling interval: the colour is the sensor's.

    With one of its own, a record that the model fits worst would count least.
    """
    steps = [segment.decay.step for segment in segments]
    shared = {
        step: fit_autoregression(
            np.concatenate(
                [e - e.mean() for e, own in zip(residuals, steps, strict=True) if math.isclose(own, step)]
            )
        )
        for step in set(steps)
    }
    return tuple(shared[step] for step in steps)


def _result(search: Search, trail: tuple[str, ...], white: LoopFit) -> SearchResult:
    """Weigh the candidates, and set the Coulomb model alone, its rest position free, beside them."""
    ranked = search.ranked()
    sets = [c.effects for c in ranked]
    fits = [c.fit for c in ranked]
    log_weights = np.array([c.log_weight for c in ranked])
    probabilities = posterior_probabilities(fits, log_weights)
    if frozenset() not in sets:
        # samples held at an end of the range have no probability under a sensor that does not clip
        sets.append(frozenset())
        fits.append(_alone(search))
        log_weights = np.append(log_weights, -np.inf)
        probabilities = np.append(probabilities, 0.0)
    return SearchResult(
        sets=tuple(sets),
        fits=tuple(fits),
        log_weights=log_weights,
        probabilities=probabilities,
        allowed=search.allowed,
        before=_alone(search, SENSOR_OFFSET.name),
        ar=search.ar,
        trail=trail,
        white=white,
    )


def _alone(search: Search, *zero: str) -> LoopFit:
    """Coulomb friction alone, as the search has fitted it where it has."""
    names = frozenset(zero)
    if names in search.candidates:
        return search.candidates[names].fit
    return coulomb_model(search.system, search.segments, search.ar, *zero)


def coulomb_model(
    system: Oscillator, segments: tuple[Segment, ...], ar: tuple[Array, ...], *zero: str
) -> LoopFit:
    """Fit Coulomb friction alone.

    Parameters
    ----------
    system : Oscillator
    segments : tuple of Segment
    ar : tuple of ndarray
        Autoregression of each record's noise; empty where it is white.
    *zero : str
        The error of the sensor's zero that there may be; none where left out.

    Raises
    ------
    InputError
        If that cannot be fitted.
    """
    model = LoopModel(system, segments, zero)
    fit = fit_growing_record(model, [NoiseModel(a) for a in ar], starting_point(model))
    if fit is None:
        raise no_decay_fits(segments[0].decay.name, system)
    return fit
