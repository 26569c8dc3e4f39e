"""The effect catalogue: names, supports, units, priors and the registry."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import takewhile

import numpy as np
import pytest
from scipy.integrate import quad

from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.core.system import Oscillator
from friction_bayes.mechanics.effects import (
    BUILT_IN,
    EFFECTS,
    Extent,
    ForceEffect,
    Scales,
    SensorEffect,
    effect_named,
    force_effects,
    force_vector,
    parse_effects,
    register,
)
from friction_bayes.mechanics.effects.prior import half_normal, log_normal, normal, uniform

# A frequency from one swing of the record to half the sampling rate, a phase of one turn.
BOUNDED_BY_THE_RECORD = {"frequency": (0.1, 250.0), "phase": (-math.pi, math.pi)}

LINEAR = Oscillator(mass=2.0, stiffness=800.0)
ANGULAR = Oscillator(inertia=2.0, stiffness=800.0)
SCALES = Scales(
    system=LINEAR, quantity=QUANTITIES["velocity"], amplitude=0.02, duration=10.0, sampling_rate=500.0
)
FOUR_HARMONICS = tuple(
    f"{often}_{wave}" for often in ("once", "twice", "thrice", "four_times") for wave in ("sine", "cosine")
)
CATALOGUE = {
    "viscous_damping": ("force", {"damping_ratio": ("1", "1")}),
    "quadratic_drag": ("force", {"drag_coefficient": ("kg/m", "kg m2")}),
    "asymmetric_friction": ("force", {"asymmetry": ("1", "1")}),
    "stribeck_friction": ("force", {"static_excess": ("1", "1"), "stribeck_velocity": ("m/s", "rad/s")}),
    "friction_drift": ("force", {"relative_change": ("1", "1")}),
    "curved_friction_drift": ("force", {"relative_change": ("1", "1"), "time_share": ("1", "1")}),
    "cubic_stiffness": ("force", {"cubic_stiffness": ("N/m3", "N m/rad3")}),
    "stiffness_drift": ("force", {"relative_change": ("1", "1")}),
    "sensor_offset": ("sensor", {"offset": ("V", "V")}),
    "sensor_drift": ("sensor", {"offset": ("V", "V"), "rate": ("V/s", "V/s")}),
    "curved_sensor_drift": (
        "sensor",
        {
            "offset": ("V", "V"),
            "rate": ("V/s", "V/s"),
            "curvature": ("V/s2", "V/s2"),
            "cubic": ("V/s3", "V/s3"),
        },
    ),
    "presliding": ("force", {"displacement": ("m", "rad")}),
    "position_friction": ("force", {"slope": ("1/m", "1/rad"), "curvature": ("1/m2", "1/rad2")}),
    "random_force": ("process", {"sd": ("N", "N m"), "correlation_time": ("s", "s")}),
    "sensor_hysteresis": ("sensor", {"half_width": ("V", "V"), "play": ("V", "V")}),
    "position_force": ("force", dict.fromkeys(FOUR_HARMONICS, ("N", "N m"))),
    "sensor_nonlinearity": ("sensor", {"curvature": ("1/V", "1/V"), "cubic": ("1/V2", "1/V2")}),
    "encoder_eccentricity": ("sensor", dict.fromkeys(FOUR_HARMONICS, ("V", "V"))),
    "sensor_clipping": ("sensor", {"level": ("V", "V")}),
    "second_mode": (
        "sensor",
        {"sine": ("V", "V"), "cosine": ("V", "V"), "frequency": ("Hz", "Hz"), "decay_time": ("s", "s")},
    ),
    "periodic_interference": (
        "sensor",
        {"amplitude": ("V", "V"), "frequency": ("Hz", "Hz"), "phase": ("rad", "rad")},
    ),
    "timing_jitter": ("noise", {"sd": ("s", "s")}),
    "proportional_noise": ("noise", {"share": ("1", "1")}),
    "outliers": ("noise", {"fraction": ("1", "1"), "scale": ("V", "V")}),
}


def test_the_catalogue_is_the_documented_one():
    found = {
        effect.name: (
            effect.kind,
            {p.name: (p.unit_in(LINEAR, "V"), p.unit_in(ANGULAR, "V")) for p in effect.parameters},
        )
        for effect in BUILT_IN
    }
    assert found == CATALOGUE


@pytest.mark.parametrize("effect", BUILT_IN, ids=lambda effect: effect.name)
def test_priors_are_proper_and_fill_exactly_the_support(effect):
    for parameter, prior in zip(effect.parameters, effect.priors(SCALES), strict=True):
        support = BOUNDED_BY_THE_RECORD.get(parameter.name, (parameter.low, parameter.high))
        assert (prior.low, prior.high) == pytest.approx(support)
        scipy_prior = prior.distribution
        draws = scipy_prior.rvs(50, random_state=np.random.default_rng(3))
        for value in draws:
            parameter.check(parameter.name, value)
        np.testing.assert_allclose(prior.log_density(draws), scipy_prior.logpdf(draws), rtol=1e-9)
        low, high = scipy_prior.ppf([1e-12, 1.0 - 1e-12])
        middle = scipy_prior.ppf(0.5)
        mass = sum(
            quad(lambda x, prior=prior: math.exp(prior.log_density(x)), *ends, limit=200)[0]
            for ends in ((low, middle), (middle, high))
        )
        assert mass == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    "prior", [half_normal(2.0), normal(1.0, -1.0, 1.0), log_normal(3.0, 0.5), uniform(0.0, 2.0)]
)
def test_outside_its_support_a_prior_has_no_density(prior):
    assert prior.log_density(-1.5) == -math.inf
    assert np.all(np.isfinite(prior.log_density([0.1, 0.9])))


def test_drag_and_cubic_priors_scale_with_the_declared_system():
    (drag,) = effect_named("quadratic_drag").priors(SCALES)
    # the drop of a half cycle at the full amplitude, (4/3)(b/m) A^2, equals pi zeta A at zeta = 1/(w0 T)
    drop = 4.0 / 3.0 * drag.scale / LINEAR.moving * SCALES.amplitude**2
    zeta = 1.0 / (LINEAR.natural_frequency * SCALES.duration)
    assert drop == pytest.approx(math.pi * zeta * SCALES.amplitude)
    (cubic,) = effect_named("cubic_stiffness").priors(SCALES)
    assert cubic.scale * SCALES.amplitude**2 == pytest.approx(0.2 * LINEAR.stiffness)
    assert SCALES.signal == pytest.approx(SCALES.velocity)


def test_what_has_a_default_is_not_asked_for():
    with pytest.raises(InputError, match="is missing; give sine, frequency and decay_time together"):
        EFFECTS["second_mode"].values({"sine": 1e-3})
    with pytest.raises(InputError, match=r"is missing; give damping_ratio$"):
        EFFECTS["viscous_damping"].values({})


def _begins(name: str) -> int:
    """Where an effect's parameters begin in the vector of those of all forces."""
    before = takewhile(lambda effect: effect.name != name, force_effects())
    return sum(len(effect.parameters) for effect in before)


def test_force_vector_lays_effects_out_by_the_registry_and_zero_is_neutral():
    stribeck = _begins("stribeck_friction")
    vector = force_vector(
        {"stribeck_friction": (0.5, 0.1), "sensor_offset": (9.0,), "friction_drift": (-1.0,)}
    )
    assert vector[stribeck : stribeck + 2].tolist() == [0.5, 0.1]
    assert vector[_begins("friction_drift")] == -1.0
    assert np.count_nonzero(vector) == 3
    neutral = np.zeros_like(vector)
    for effect in force_effects():
        force = effect.force(0.3, 0.1, -0.2, -1.0, 2.0, 1.0, 2.0, 800.0, neutral, _begins(effect.name))
        assert force == 0.0


@pytest.mark.parametrize("name", ["viscous_damping", "quadratic_drag", "stribeck_friction", "friction_drift"])
def test_dissipative_forces_oppose_the_motion(name):
    vector = force_vector({name: (0.5, 0.1)[: len(EFFECTS[name].parameters)]})
    i = _begins(name)
    effect = EFFECTS[name]
    assert isinstance(effect, ForceEffect)
    forward, backward = (
        effect.force(0.9, 0.0, 0.2 * s, s, 2.0, 1.0, 2.0, 800.0, vector, i) for s in (1.0, -1.0)
    )
    assert forward > 0.0
    assert backward == -forward


def test_sensor_effects_do_what_they_say():
    time = np.linspace(0.0, 1.0, 5)
    signal = np.array([0.0, 1.0, -3.0, 2.0, 0.5])

    def shown(name, *values):
        effect = EFFECTS[name]
        assert isinstance(effect, SensorEffect)
        return effect.distort(signal, time, *values)

    np.testing.assert_array_equal(shown("sensor_offset", 0.5), signal + 0.5)
    np.testing.assert_array_equal(shown("sensor_drift", 0.5, 2.0), signal + 0.5 + 2.0 * time)
    curve = 0.5 + 2.0 * time - 3.0 * time**2 + 4.0 * time**3
    np.testing.assert_allclose(shown("curved_sensor_drift", 0.5, 2.0, -3.0, 4.0), signal + curve, atol=1e-15)
    np.testing.assert_array_equal(shown("sensor_clipping", 1.5), [0.0, 1.0, -1.5, 1.5, 0.5])
    tone = shown("periodic_interference", 0.1, 0.25, math.pi / 2) - signal
    np.testing.assert_allclose(tone, 0.1 * np.cos(math.pi / 2 * time), atol=1e-12)


def test_defaults_fill_in_and_order_is_that_of_the_parameters():
    parsed = parse_effects(
        {
            "periodic_interference.frequency": 50,
            "periodic_interference.amplitude": 0.1,
            "sensor_drift.rate": -2.0,
        }
    )
    assert parsed == {"sensor_drift": (0.0, -2.0), "periodic_interference": (0.1, 50.0, 0.0)}
    assert parse_effects(None) == {}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"magic.power": 1.0}, ("magic", "viscous_damping", "outliers")),
        ({"viscous_damping": 1.0}, ("viscous_damping.damping_ratio",)),
        ({"viscous_damping.zeta": 1.0}, ("zeta", "damping_ratio")),
        ({"viscous_damping.damping_ratio": -0.1}, ("viscous_damping.damping_ratio", "-0.1", "[0, inf)")),
        ({"asymmetric_friction.asymmetry": 1.2}, ("1.2", "[-1, 1]")),
        ({"friction_drift.relative_change": math.nan}, ("friction_drift.relative_change", "nan")),
        ({"stribeck_friction.static_excess": 1.0}, ("stribeck_velocity", "missing")),
        (
            {"stribeck_friction.static_excess": 1.0, "stribeck_friction.stribeck_velocity": 0.0},
            ("stribeck_velocity", "(0, inf)"),
        ),
        (
            {"sensor_offset.offset": 1.0, "sensor_drift.rate": 1.0},
            ("sensor_offset", "sensor_drift", "exclude"),
        ),
        ({"outliers.fraction": 1.5, "outliers.scale": 1.0}, ("outliers.fraction", "[0, 1]")),
    ],
)
def test_bad_effects_are_refused_with_a_remedy(settings, words):
    with pytest.raises(InputError) as caught:
        parse_effects(settings)
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_name_is_registered_once():
    with pytest.raises(InputError, match="already registered"):
        register(EFFECTS["outliers"])


@pytest.mark.parametrize("extent", [Extent(0), Extent(9), Extent(4, 0.0), Extent(4, math.inf)])
def test_a_series_reaches_over_parameters_that_it_has(extent):
    series = replace(EFFECTS["encoder_eccentricity"], name="own_series", series=(Extent(8), extent))
    with pytest.raises(InputError, match="own_series: its series cannot reach over"):
        register(series)
    assert "own_series" not in EFFECTS


@pytest.mark.parametrize(
    ("signal_unit", "unit"), [("m", "1/m"), ("m/s", "1/(m/s)"), ("rad/s2", "1/(rad/s2)")]
)
def test_a_unit_over_that_of_the_signal_has_parentheses_where_it_needs_them(signal_unit, unit):
    curvature, cubic = EFFECTS["sensor_nonlinearity"].parameters
    assert curvature.unit_in(LINEAR, signal_unit) == unit
    assert cubic.unit_in(LINEAR, signal_unit) == f"{unit}2"
