"""Records drawn from the priors that the loop states: which effects act, and how large they are.

The distributions are read from the package, which is under test; every record is simulated by
:mod:`experiments.blind`, which shares no code with it. Strengths are those of a system of unit mass and
stiffness, so that time is a phase.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

from experiments.blind.disturbed_motion import DisturbedMotion
from experiments.blind.draws import log_uniform
from experiments.blind.hidden import Seen, nats_against, seen
from experiments.blind.prior_drawn import (
    AddedLaw,
    Sensor,
    measure,
    move,
    pushed_share,
    release,
    shows_a_decay,
    turning_points,
)
from friction_bayes import Oscillator, make_record
from friction_bayes.core.quantities import quantity_named
from friction_bayes.loop.columns.effect_columns import OF_LINES
from friction_bayes.loop.columns.law_columns import SENSOR_ZERO
from friction_bayes.loop.data.friction import friction_of_loss
from friction_bayes.loop.infer.law_along_motion import force_prior
from friction_bayes.loop.settings import SETTINGS
from friction_bayes.mechanics.effects import BUILT_IN, EFFECTS, ForceEffect, Scales
from friction_bayes.mechanics.effects.curved_sensor_drift import CURVED_SENSOR_DRIFT
from friction_bayes.mechanics.effects.inclusion import EXPECTED, inclusion
from friction_bayes.statespace.force_prior import ForcePrior

__all__ = [
    "NAMES",
    "RANDOM_FORCE",
    "SLIGHT",
    "DrawnRecord",
    "Setting",
    "draw",
    "draw_effects",
    "draw_setting",
    "offered",
]

RANDOM_FORCE = "random_force"
NAMES = tuple(effect.name for effect in BUILT_IN)
"""Of the catalogue, in its order."""

QUANTITIES = ("displacement", "velocity", "acceleration", "angle")
HALF_CYCLES = (8, 70)
SAMPLES_PER_PERIOD = (16.0, 160.0)
SIGNAL_TO_NOISE_DB = (22.0, 46.0)
NATURAL_FREQUENCY_HZ = (0.2, 50.0)
MOVING = (0.05, 50.0)
AMPLITUDE_M = (1e-4, 0.1)
SWING_RAD = (0.02, 6.0)

_OF_FRICTION = frozenset(
    {
        "asymmetric_friction",
        "stribeck_friction",
        "friction_drift",
        "curved_friction_drift",
        "presliding",
        "position_friction",
    }
)
_BENDS_FRICTION = frozenset({"stribeck_friction", "presliding"})
SLIGHT = {"viscous_damping": "damping_ratio", "friction_drift": "relative_change"}
"""Effects that a record may have without showing them, and their strength in a law."""
_MOST_DRAWS = 30
"""Of a random force until one is hidden: a record in which none is shows every force."""
_OF_NOISE = frozenset({"timing_jitter", "proportional_noise", "outliers", "sensor_clipping"})
_MOST_PUSHED = 0.1
"""Work of friction that may drive the motion: with more the loop does not take a law for one."""
_LEAST_LOSS = 2e-4
"""Friction over stiffness and amplitude that would explain the loss, below which nothing is lost."""
_OF_HARMONIC = 0.05
"""Share of the motion's frequency within which of its harmonics nothing is a second mode."""


@dataclass(frozen=True, kw_only=True)
class Setting:
    """What is not a matter of the loop's priors.

    Attributes
    ----------
    quantity : str
    swing : float
        Initial amplitude [m or rad].
    half_cycles : int
        Length of the record.
    samples_per_period, snr_db : float
    phase : float
        Of the start; zero is a release.
    natural_frequency : float
        [rad/s].
    moving : float
        Mass [kg] or inertia [kg m2].
    """

    quantity: str
    swing: float
    half_cycles: int
    samples_per_period: float
    snr_db: float
    phase: float
    natural_frequency: float
    moving: float

    @property
    def duration(self) -> float:
        """Of the record, a phase."""
        return math.pi * self.half_cycles

    @property
    def samples(self) -> int:
        """In the record."""
        return int(0.5 * self.half_cycles * self.samples_per_period)

    @property
    def scales(self) -> Scales:
        """Of the priors, for a system of unit mass and stiffness."""
        return Scales(
            system=Oscillator(**{self._moving: 1.0, "stiffness": 1.0}),
            quantity=quantity_named(self.quantity),
            amplitude=self.swing,
            duration=self.duration,
            sampling_rate=self.samples_per_period / (2.0 * math.pi),
        )

    @property
    def system(self) -> dict[str, float]:
        """What is declared of the system, SI."""
        return {self._moving: self.moving, "stiffness": self.moving * self.natural_frequency**2}

    @property
    def _moving(self) -> str:
        return "inertia" if self.quantity == "angle" else "mass"


@dataclass(frozen=True, kw_only=True)
class DrawnRecord:
    """A record, and what only the judge may open.

    Attributes
    ----------
    record : xarray.DataArray
    setting : Setting
    effects : tuple of str
        Those that act, a random force among them.
    offered : tuple of str
        Those that might have acted.
    friction : float
        [N or N m].
    loss : float
        Friction that alone would explain the loss of amplitude [N or N m].
    parameters : dict
        Strengths by effect.
    slight : dict
        The same of what acts in addition, too little to be seen.
    rests : bool
        Whether it reaches the rest.
    attempts : int
        Draws until one showed a free decay.
    """

    record: xr.DataArray
    setting: Setting
    effects: tuple[str, ...]
    offered: tuple[str, ...]
    friction: float
    loss: float
    parameters: dict[str, tuple[float, ...]]
    slight: dict[str, tuple[float, ...]]
    rests: bool
    attempts: int


def draw_setting(rng: np.random.Generator) -> Setting:
    """Draw system, swing, sensor, sampling and noise; half of the records begin with a release."""
    quantity = str(rng.choice(QUANTITIES))
    return Setting(
        quantity=quantity,
        swing=log_uniform(rng, *(SWING_RAD if quantity == "angle" else AMPLITUDE_M)),
        half_cycles=round(log_uniform(rng, *HALF_CYCLES)),
        samples_per_period=log_uniform(rng, *SAMPLES_PER_PERIOD),
        snr_db=float(rng.uniform(*SIGNAL_TO_NOISE_DB)),
        phase=float(rng.uniform(0.0, 2.0 * math.pi)) if rng.random() < 0.5 else 0.0,
        natural_frequency=2.0 * math.pi * log_uniform(rng, *NATURAL_FREQUENCY_HZ),
        moving=log_uniform(rng, *MOVING),
    )


def offered(setting: Setting) -> tuple[str, ...]:
    """Effects that may act: what a set-up cannot have or show, by the loop's own rules, is not drawn."""
    names = [
        effect.name
        for effect in BUILT_IN
        if effect.name != RANDOM_FORCE and not effect.why_not(setting.scales)
    ]
    if setting.scales.quantity.order:
        # a constant force moves the centre, which these do not show
        names.remove("asymmetric_friction")
    return tuple(names)


def draw_effects(names: Collection[str], rng: np.random.Generator) -> tuple[str, ...]:
    """Draw which effects act, all with one unknown probability, until the loop might form the set.

    A random force has a probability of its own.
    """
    while True:
        act = rng.beta(1.0, len(NAMES) / EXPECTED)
        of_force = 1.0 - ForcePrior.none
        chosen = tuple(name for name in names if rng.random() < (of_force if name == RANDOM_FORCE else act))
        counted = set(chosen) - (SENSOR_ZERO - {CURVED_SENSOR_DRIFT.name}) - set(OF_LINES) - _OF_NOISE
        excluded = any(other in chosen for name in chosen for other in EFFECTS[name].excludes)
        if len(counted) <= SETTINGS.most_at_once and len(_BENDS_FRICTION & counted) < 2 and not excluded:
            return chosen


def _draw_parameters(name: str, scales: Scales, rng: np.random.Generator) -> tuple[float, ...]:
    effect = EFFECTS[name]
    values = np.array([float(p.distribution.rvs(random_state=rng)) for p in effect.priors(scales)])
    if effect.series:
        extent = effect.series[int(rng.integers(len(effect.series)))]
        values *= np.where(np.arange(values.size) < extent.parameters, extent.width, 0.0)
    if name == "sensor_hysteresis":
        # the loop evaluates two plays
        values[1] = 2.0 * values[0] * int(rng.integers(2))
    frequency, decay_time = values[2:] if name == "second_mode" else (0.0, 0.0)
    if decay_time and not _apart_from_the_motion(2.0 * math.pi * frequency, decay_time, scales.duration):
        return _draw_parameters(name, scales, rng)
    return tuple(values.tolist())


def _apart_from_the_motion(frequency: float, decay_time: float, duration: float) -> bool:
    """Whether the loop takes a decaying line for a second mode: it lies apart from the motion's harmonics.

    That is by a share of the motion's frequency and by its own width. It lasts a period of its own, and less
    than half of the record.
    """
    least = max(_OF_HARMONIC, 2.0 / decay_time)
    apart = abs(frequency - round(frequency)) >= least
    return apart and 2.0 * math.pi / frequency <= decay_time <= 0.5 * duration


def _law(friction: float, setting: Setting, drawn: Mapping[str, tuple[float, ...]]) -> AddedLaw:
    """The law in initial amplitudes."""
    s = setting.swing
    given: dict[str, Any] = {}
    for name, p in drawn.items():
        match name:
            case "viscous_damping":
                given |= {"damping_ratio": p[0]}
            case "quadratic_drag":
                given |= {"drag": p[0] * s}
            case "asymmetric_friction":
                given |= {"asymmetry": p[0]}
            case "stribeck_friction":
                given |= {"static_excess": p[0], "stribeck_velocity": p[1] / s}
            case "friction_drift":
                given |= {"relative_change": p[0]}
            case "curved_friction_drift":
                given |= {"relative_change": p[0], "drift_time": p[1]}
            case "cubic_stiffness":
                given |= {"cubic": p[0] * s**2}
            case "stiffness_drift":
                given |= {"stiffness_change": p[0]}
            case "presliding":
                given |= {"presliding": p[0] / s}
            case "position_friction":
                given |= {"friction_tilt": p[0] * s, "friction_bend": p[1] * s**2}
            case "position_force":
                given |= {"swing": s} | _turn_series(p, s)
    return AddedLaw(friction=friction, duration=setting.duration, **given)


def _mean_level(law: AddedLaw, motion: DisturbedMotion) -> float:
    """Friction averaged over the time in which the mass moves, over that averaged over the record."""
    until = 1.0 if motion.rest_time is None else min(motion.rest_time / law.duration, 1.0)
    return 1.0 + law.relative_change * float(np.mean([law.drifted(u) for u in np.linspace(0.0, until, 201)]))


def _pushes_at_some_time(law: AddedLaw) -> bool:
    """Whether friction falls below zero as the record goes on, which no contact does, and no stop ends."""
    return min(1.0 + law.relative_change * law.drifted(u) for u in (0.0, 1.0)) < 0.0


def _turn_series(coefficients: tuple[float, ...], swing: float) -> dict[str, tuple[float, ...]]:
    over_swing = tuple(each / swing for each in coefficients)
    return {"turn_sines": over_swing[0::2], "turn_cosines": over_swing[1::2]}


def _sensor(setting: Setting, drawn: Mapping[str, tuple[float, ...]]) -> Sensor:
    """The sensor in initial amplitudes, of the derivative that is measured."""
    s = setting.swing
    faults: dict[str, float] = {}
    given: dict[str, Any] = {}
    for name, p in drawn.items():
        match name:
            case "sensor_nonlinearity":
                faults |= {"scale_square": p[0] * s, "scale_cube": p[1] * s**2}
            case "sensor_offset":
                faults |= {"offset": p[0] / s}
            case "sensor_drift":
                faults |= {"offset": p[0] / s, "drift": p[1] * setting.duration / s}
            case "curved_sensor_drift":
                terms = zip(("offset", "drift", "drift_square", "drift_cube"), p, strict=True)
                faults |= {key: each * setting.duration**k / s for k, (key, each) in enumerate(terms)}
            case "sensor_hysteresis" if p[1]:
                faults |= {"backlash": 0.5 * p[1] / s}
            case "sensor_hysteresis":
                given |= {"lag": p[0] / s}
            case "encoder_eccentricity":
                given |= {"swing": s} | _turn_series(p, s)
            case "sensor_clipping":
                given |= {"clipping": p[0] / s}
            case "periodic_interference":
                faults |= {
                    "interference_amplitude": p[0] / s,
                    "interference_frequency": 2.0 * math.pi * p[1],
                    "interference_phase": p[2],
                }
            case "second_mode":
                faults |= {
                    "mode_amplitude": math.hypot(p[0], p[1]) / s,
                    "mode_phase": math.atan2(-p[0], p[1]),
                    "mode_frequency": 2.0 * math.pi * p[2],
                    "mode_decay": 1.0 / p[3],
                }
            case "timing_jitter":
                given |= {"jitter": p[0]}
            case "proportional_noise":
                given |= {"noise_share": p[0]}
            case "outliers":
                given |= {"outlier_fraction": p[0], "outlier_sd": p[1] / s}
    return Sensor(order=setting.scales.quantity.order, faults=faults, **given)


def _draw_slight(
    looked_at: Seen,
    setting: Setting,
    acting: Mapping[str, tuple[float, ...]],
    prior: ForcePrior,
    rng: np.random.Generator,
) -> dict[str, tuple[float, ...]]:
    """Draw what acts in addition to a set of effects, of the sizes that the loop gives to slight effects.

    Their prior is a few standard deviations with which the record shows them
    (:mod:`friction_bayes.loop.mixture.slight_effects`).
    """
    slight: dict[str, tuple[float, ...]] = {}
    force = acting.get(RANDOM_FORCE)
    bent = any(isinstance(EFFECTS[name], ForceEffect) for name in acting)
    often = inclusion() if bent else SETTINGS.nuisance
    for name, strength in SLIGHT.items():
        effect = EFFECTS[name]
        if rng.random() < often and not {name, *effect.excludes}.intersection(acting):
            (parameter,) = effect.priors(setting.scales)
            own = parameter.scale
            scale = min(SETTINGS.unseen * looked_at.sd_of(strength, force), own)
            low = -SETTINGS.gain_rise * own if effect.parameters[0].low == 0.0 else -math.inf
            slight[name] = (float(stats.truncnorm(low / scale, math.inf, scale=scale).rvs(random_state=rng)),)
    if force is None and rng.random() < SETTINGS.nuisance:
        for _ in range(_MOST_DRAWS):
            size, correlation_time = _draw_force(prior, rng)
            against = nats_against(size, looked_at.force_variances(correlation_time))
            if against <= 0.5 * SETTINGS.unseen**2:
                return slight | {RANDOM_FORCE: (size, correlation_time)}
    return slight


def _draw_force(prior: ForcePrior, rng: np.random.Generator) -> tuple[float, float]:
    """Standard deviation and correlation time."""
    size = prior.centre * math.exp(prior.spread * float(rng.standard_normal()))
    return size, log_uniform(rng, prior.tau_low, prior.tau_high)


def draw(seed: np.random.SeedSequence | int) -> DrawnRecord:
    """Draw a record; draws that show no free decay are drawn again, setting and all."""
    rng = np.random.default_rng(seed)
    attempts = 1
    while (found := _attempt(rng, attempts)) is None:
        attempts += 1
    return found


def _attempt(rng: np.random.Generator, attempts: int) -> DrawnRecord | None:
    setting = draw_setting(rng)
    names = offered(setting)
    chosen = draw_effects(names, rng)
    drawn = {name: _draw_parameters(name, setting.scales, rng) for name in chosen}
    friction = SETTINGS.friction_share * abs(float(rng.standard_normal()))
    if not _OF_FRICTION.intersection(chosen) and rng.random() < SETTINGS.no_dry_friction:
        friction = 0.0
    if setting.half_cycles * friction > 1.0:
        # at rest long before the end, which the integration need not find out
        return None
    law, start = _law(friction, setting, drawn), release(setting.phase)
    if _pushes_at_some_time(law):
        return None
    try:
        motion = move(law, start, None, rng)
    except OverflowError:
        # friction that drives the motion has let it run away
        return None
    if motion.turning_times.size < 3 or pushed_share(motion) > _MOST_PUSHED:
        return None
    loss = friction_of_loss(turning_points(motion))
    prior = force_prior(max(loss, _LEAST_LOSS))
    if rng.random() >= prior.none:
        chosen, drawn = (*chosen, RANDOM_FORCE), drawn | {RANDOM_FORCE: _draw_force(prior, rng)}
    sensor = _sensor(setting, drawn)
    times = np.arange(setting.samples) * 2.0 * math.pi / setting.samples_per_period
    rms = float(np.sqrt(np.mean(motion.sample(times)[0] ** 2)))
    noise_sd = rms * 10.0 ** (-setting.snr_db / 20.0)
    slight: dict[str, tuple[float, ...]] = {}
    if friction:
        looked_at = seen(law, start, sensor.order, times, noise_sd)
        slight = _draw_slight(looked_at, setting, drawn, prior, rng)
        strengths = {SLIGHT[name]: p[0] for name, p in slight.items() if name in SLIGHT}
        law = replace(law, **strengths)
    force = (drawn | slight).get(RANDOM_FORCE)
    if slight or force:
        if _pushes_at_some_time(law):
            return None
        motion = move(law, start, force, rng)
    if not shows_a_decay(motion):
        return None
    values, clipped = measure(motion, sensor, times, noise_sd, rng)
    if not clipped:
        # clipping at a level that nothing reaches does not act in this record
        chosen = tuple(name for name in chosen if name != "sensor_clipping")
    w0, unit = setting.natural_frequency, setting.swing
    force_unit = setting.system["stiffness"] * unit
    record = make_record(
        times / w0,
        values * unit * w0**sensor.order,
        setting.quantity,
        name="drawn record",
        synthetic=True,
    )
    return DrawnRecord(
        record=record,
        setting=setting,
        effects=chosen,
        offered=(*names, RANDOM_FORCE),
        friction=friction * _mean_level(law, motion) * force_unit,
        loss=friction_of_loss(turning_points(motion)) * force_unit,
        parameters=drawn,
        slight=slight,
        rests=motion.rest_time is not None,
        attempts=attempts,
    )
