"""Every number that decides in a closed loop and is no tolerance of numerics, in one place."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

__all__ = ["SETTINGS", "LoopSettings"]


def _setting(value: Any, unit: str, meaning: str, source: str) -> Any:
    return field(default=value, metadata={"unit": unit, "meaning": meaning, "source": source})


@dataclass(frozen=True, kw_only=True)
class LoopSettings:
    """Rates of false alarm, priors, and limits from which on something counts.

    Each field has its ``unit``, ``meaning`` and ``source`` in its metadata. The priors of effects are theirs
    (:mod:`friction_bayes.mechanics.effects`), the tolerance is an option. What moves with each is in
    ``docs/loop_settings.md``.
    """

    # tests
    false_alarm_rate: float = _setting(
        0.01,
        "probability",
        "that a test of the residual, of witnesses, of several records or for a knock fails by chance",
        "convention",
    )
    noise_alarm_rate: float = _setting(
        1e-4,
        "probability",
        "that white noise passes for coloured, or outliers for uneven, by chance",
        "a hundredth of the rate of the tests: each changes the noise model of the whole record",
    )
    far: float = _setting(
        4.0,
        "sd",
        "distance from which on a sample lies far out, is clipped for a spectrum, or cannot be noise",
        "normal noise has 6 of 100,000 samples there",
    )
    unseen: float = _setting(
        2.0,
        "sd",
        "within which two frictions agree; width of the prior of a slight effect in sd of its estimate; "
        "its square over two: nats by which a slight force may change the evidence",
        "convention",
    )
    minor_share: float = _setting(
        0.1,
        "share",
        "of the work of dry friction that may drive the motion, of a sum of squares in one sample or in "
        "outliers, of a force that a law must leave for a test of it",
        "judgement",
    )
    bins: int = _setting(
        8,
        "number",
        "parts of a record or spectrum that are compared",
        "judgement: changes over an eighth are seen, each part keeps many samples",
    )
    travel_bins: int = _setting(
        10, "number", "parts of the range of velocity, position and amplitude that are compared", "judgement"
    )

    # verdict
    credible_mass: float = _setting(0.95, "probability", "that the sets of a verdict hold", "interface")
    most_shift: float = _setting(
        0.5, "share", "of the loss that what is left may shift friction by", "interface"
    )
    least_inside: float = _setting(0.75, "share", "of held-out samples in their 90 % band", "interface")
    worse_forecast: float = _setting(
        0.05, "share", "by which a forecast is worse than that of Coulomb friction alone", "interface"
    )
    fitted_share: float = _setting(0.7, "share", "of a record from which the rest is forecast", "convention")
    same_friction: float = _setting(0.01, "share", "within which frictions are the same", "judgement")

    # which candidates are evaluated
    most_at_once: int = _setting(
        3,
        "number",
        "effects of a set but for lines, a zero that moves along no curve, and certain ones; knocks in a "
        "record; rivals that a further record has to decide between",
        "more are no accident; cost",
    )
    least_information: float = _setting(
        0.3,
        "over that of the prior",
        "of the samples on an effect that is evaluated",
        "judgement; without it an effect that nothing can show keeps its prior, and the law has 0.03 less in "
        "one blind record in four",
    )

    # preparation of a record
    rest_kept: float = _setting(
        0.15, "share", "of the moving time that is kept after the stop", "shows the sensor's zero"
    )

    # priors
    friction_share: float = _setting(
        0.05,
        "over stiffness times amplitude",
        "prior scale of friction",
        "a decay of three half cycles has 0.15",
    )
    frequency_sd: float = _setting(
        0.2, "logarithm", "prior sd of the natural over the declared frequency", "stiffness known to 40 %"
    )
    stiffness_sd: float = _setting(
        0.05,
        "share",
        "prior sd of the stiffness about what the measured motion shows",
        "wider, a sensor effect takes the place of the motion",
    )
    state_share: float = _setting(
        2.0, "largest in the record", "prior sd of the initial displacement and velocity", "wide"
    )
    no_dry_friction: float = _setting(
        0.2, "probability", "prior, that nothing rubs where no effect bends or scales friction", "judgement"
    )
    force_share: float = _setting(
        0.2, "friction of the loss", "prior median of the sd of a random force", "sealed records"
    )
    nuisance: float = _setting(
        0.2,
        "probability",
        "prior, that a slight effect or force acts, and that friction differs between records",
        "loop_calibration: with 0.5 intervals are half as wide again, and ranks not uniform",
    )
    gain_rise: float = _setting(
        0.2, "share", "by which a sensor's gain may rise within a record", "near_threshold"
    )
    spreads: tuple[float, float] = _setting(
        (1e-3, 0.6), "over friction", "least and largest spread of friction between records", "wide"
    )
    error_ratio_sd: float = _setting(
        2.0,
        "logarithm",
        "prior sd of the correlated over the white error of a sensor",
        "wide; one measured pendulum alone has such an error",
    )
    longest_error: float = _setting(
        0.2 * math.pi,
        "rad",
        "longest correlation time of a sensor's error",
        "a tenth of a period; as the one before",
    )

    # noise, lines and knocks
    quiet_harmonic: float = _setting(
        8.0,
        "the motion's frequency",
        "above which a decay has next to no power; half of it where samples are few",
        "odd harmonics fall fast; with any colour the noise takes up the law of one measured record",
    )
    knock_part: float = _setting(
        0.25, "share", "of its largest score from which on neighbours belong to a knock", "judgement"
    )
    knock_frictions: float = _setting(
        3.0, "friction of the loss", "prior sd of a knock's force", "seen where it is several times friction"
    )
    longest_knock: float = _setting(2.0, "rad", "that a knock lasts at most", "a third of a period")


SETTINGS = LoopSettings()
"""Those in use."""
