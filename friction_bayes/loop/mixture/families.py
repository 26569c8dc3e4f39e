"""The candidates of some records: along their motions, or by a search where that cannot be done."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from friction_bayes.core.system import Oscillator
from friction_bayes.loop.data.options import LoopOptions
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.mixture.joint_family import JointFamily, joint_family
from friction_bayes.loop.mixture.mixture import Family
from friction_bayes.loop.mixture.record_family import RecordFamily, record_family
from friction_bayes.loop.mixture.search_family import SearchFamily
from friction_bayes.loop.search.fit import LoopFit
from friction_bayes.loop.search.run_search import search_records
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["Candidates", "candidates_of"]


@dataclass(frozen=True, eq=False)
class Candidates:
    """All candidates of some records.

    Attributes
    ----------
    before : LoopFit
        The Coulomb model alone.
    families : tuple of Family
        Those that share a likelihood each.
    """

    before: LoopFit
    families: tuple[Family, ...]

    @property
    def along_motion(self) -> bool:
        """Whether any was evaluated along the measured motions."""
        return any(not isinstance(family, SearchFamily) for family in self.families)


def candidates_of(
    segments: tuple[Segment, ...],
    system: Oscillator,
    options: LoopOptions,
    tried: tuple[str, ...],
    rngs: Sequence[np.random.Generator],
    progress: Callable[[str], None] | None,
) -> Candidates:
    """Evaluate the candidates of one record or of several.

    Parameters
    ----------
    segments : tuple of Segment
    system : Oscillator
        The declared system.
    options : LoopOptions
    tried : tuple of str
        Effects that the search tries.
    rngs : sequence of numpy.random.Generator, length 3
        Of the draws: of the search, of one record along its motion, of several.
    progress : callable, optional
        Called with the name of each record or set of effects that is fitted.

    Raises
    ------
    InputError
        If no Coulomb decay can be fitted.
    """
    rng_search, rng_one, rng_several = rngs
    rng = rng_one if len(segments) == 1 else rng_several
    along = _along_motions(segments, system, options, rng, progress)
    if along is None:
        raise RuntimeError("along none")
    return Candidates(along.before, (along,))


def _along_motions(
    segments: tuple[Segment, ...],
    system: Oscillator,
    options: LoopOptions,
    rng: np.random.Generator,
    progress: Callable[[str], None] | None,
) -> JointFamily | RecordFamily | None:
    """The records along their motions; None where that is not asked for or cannot be done."""
    if len(segments) == 1:
        return record_family(segments[0], system, options, rng)
    return joint_family(segments, system, options, rng, progress)


def _knows_the_range(segments: Sequence[Segment], allowed: Sequence[str]) -> bool:
    """Whether samples at an end of the range, if there are any, are known to lie beyond it.

    They are where the sensor may clip.
    """
    return SENSOR_CLIPPING.name in allowed or not any(segment.clipped for segment in segments)
