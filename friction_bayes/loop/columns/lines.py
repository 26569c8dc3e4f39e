"""The effects that are lines in the spectrum of a law's residual, and those lines that a record shows."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from friction_bayes.core.arrays import Array
from friction_bayes.decay.spectral_lines import Line, LineSearch, decaying_lines, steady_lines
from friction_bayes.loop import settings
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.second_mode import SECOND_MODE

__all__ = ["OF_LINES", "line_search", "lines_in_residual"]

OF_LINES = (PERIODIC_INTERFERENCE.name, SECOND_MODE.name)
"""Effects that are lines."""


def line_search(segment: Segment) -> LineSearch:
    """Where lines of a record are looked for."""
    chosen, decay = settings.SETTINGS, segment.decay
    motion = decay.frequency / (2.0 * math.pi)
    return LineSearch(decay.step, segment.duration, motion, chosen.harmonic_band, chosen.noise_alarm_rate)


def lines_in_residual(
    innovations: Array, force: Array, segment: Segment, known: Sequence[Line], effects: Collection[str]
) -> tuple[Line, ...]:
    """Lines of these effects that exceed their surroundings in a spectrum, except the motion's.

    Parameters
    ----------
    innovations : ndarray, shape (n,)
        Under the law and the random force, in standard deviations.
    force : ndarray, shape (n,)
        The random force, which hides lines that the oscillator responds to.
    segment : Segment
    known : sequence of Line
        Those that have been found: another one of the same effect lies apart from them.
    effects : collection of str
        Those that may act.
    """
    search = line_search(segment)
    found: tuple[Line, ...] = ()
    if PERIODIC_INTERFERENCE.name in effects:
        found += steady_lines((innovations, force), search, [line for line in known if line.steady])
    if SECOND_MODE.name in effects:
        # not in the force: its spectrum is so steep that windows which begin at once make tops in it
        found += decaying_lines(innovations, search, [line for line in known if not line.steady])
    return found
