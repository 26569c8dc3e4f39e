"""The effect catalogue: what may make a record differ from a Coulomb decay with white noise.

To add an effect, write one small file next to the others and name it in :data:`BUILT_IN`; from outside the
package, call :func:`register`.
"""

from __future__ import annotations

from friction_bayes.mechanics.effects.asymmetric_friction import ASYMMETRIC_FRICTION
from friction_bayes.mechanics.effects.cubic_stiffness import CUBIC_STIFFNESS
from friction_bayes.mechanics.effects.curved_friction_drift import CURVED_FRICTION_DRIFT
from friction_bayes.mechanics.effects.curved_sensor_drift import CURVED_SENSOR_DRIFT
from friction_bayes.mechanics.effects.effect import (
    Effect,
    Extent,
    ForceEffect,
    GrowingNoiseEffect,
    NoiseEffect,
    Parameter,
    ProcessEffect,
    SensorEffect,
)
from friction_bayes.mechanics.effects.encoder_eccentricity import ENCODER_ECCENTRICITY
from friction_bayes.mechanics.effects.friction_drift import FRICTION_DRIFT
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.position_force import POSITION_FORCE
from friction_bayes.mechanics.effects.position_friction import POSITION_FRICTION
from friction_bayes.mechanics.effects.presliding import PRESLIDING
from friction_bayes.mechanics.effects.prior import Prior, Scales
from friction_bayes.mechanics.effects.proportional_noise import PROPORTIONAL_NOISE
from friction_bayes.mechanics.effects.quadratic_drag import QUADRATIC_DRAG
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.registry import (
    EFFECTS,
    check_effects,
    effect_named,
    force_effects,
    force_vector,
    in_catalogue_order,
    parse_effects,
    register,
)
from friction_bayes.mechanics.effects.second_mode import SECOND_MODE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING
from friction_bayes.mechanics.effects.sensor_drift import SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_hysteresis import SENSOR_HYSTERESIS
from friction_bayes.mechanics.effects.sensor_nonlinearity import SENSOR_NONLINEARITY
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET
from friction_bayes.mechanics.effects.stiffness_drift import STIFFNESS_DRIFT
from friction_bayes.mechanics.effects.stribeck_friction import STRIBECK_FRICTION
from friction_bayes.mechanics.effects.timing_jitter import TIMING_JITTER
from friction_bayes.mechanics.effects.viscous_damping import VISCOUS_DAMPING

__all__ = [
    "BUILT_IN",
    "EFFECTS",
    "Effect",
    "Extent",
    "ForceEffect",
    "GrowingNoiseEffect",
    "NoiseEffect",
    "Parameter",
    "Prior",
    "ProcessEffect",
    "Scales",
    "SensorEffect",
    "check_effects",
    "effect_named",
    "force_effects",
    "force_vector",
    "in_catalogue_order",
    "parse_effects",
    "register",
]

BUILT_IN: tuple[Effect, ...] = (
    VISCOUS_DAMPING,
    QUADRATIC_DRAG,
    ASYMMETRIC_FRICTION,
    STRIBECK_FRICTION,
    FRICTION_DRIFT,
    CURVED_FRICTION_DRIFT,
    CUBIC_STIFFNESS,
    STIFFNESS_DRIFT,
    PRESLIDING,
    POSITION_FRICTION,
    POSITION_FORCE,
    RANDOM_FORCE,
    # bent about the rest, wherever the zero is: before what moves it
    SENSOR_NONLINEARITY,
    SENSOR_OFFSET,
    SENSOR_DRIFT,
    CURVED_SENSOR_DRIFT,
    SENSOR_HYSTERESIS,
    ENCODER_ECCENTRICITY,
    SENSOR_CLIPPING,
    PERIODIC_INTERFERENCE,
    SECOND_MODE,
    TIMING_JITTER,
    PROPORTIONAL_NOISE,
    OUTLIERS,
)
"""The effects this package brings; the integrator is compiled for their forces ahead."""

for _effect in BUILT_IN:
    register(_effect)
