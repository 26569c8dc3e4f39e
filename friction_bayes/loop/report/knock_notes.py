"""Notes of a report on the knocks of a record."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from friction_bayes.loop.infer.record_fit import ForceFit

__all__ = ["knock_notes", "knock_times"]


def knock_times(fit: ForceFit) -> list[tuple[float, float]]:
    """Start and end of each knock [s], from the first sample of the decay on."""
    time = fit.segment.time
    return [(float(time[a]), float(time[b])) for a, b in fit.knocks]


def knock_notes(fit: ForceFit, unit_force: float, unit: str) -> Iterator[str]:
    """Sentences on each knock: its time and size.

    Parameters
    ----------
    fit : ForceFit
    unit_force : float
        Of natural units, in ``unit``.
    unit : str
    """
    decay = fit.segment.decay
    for (start, end), (a, b) in zip(knock_times(fit), fit.knocks, strict=True):
        # not its level: a constant force shifts the rest position, which an accelerometer does not show
        change = unit_force * float(np.ptp(fit.fluctuation[a : b + 1]))
        yield (
            f"{decay.name}: knocked at {decay.start_time + start:.4g} s: for {end - start:.2g} s a force "
            f"acts that the rest of the record does not show, and that changes by {change:.3g} {unit}; "
            "friction and the random force are estimated without it"
        )
