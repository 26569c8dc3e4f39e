"""An error of the encoder that repeats with every turn, next to a force that fluctuates."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from friction_bayes.core.errors import InputError
from friction_bayes.loop.infer.record_fit import ForceFit
from unsteady_decays import WHEEL, WHEEL_NOISE, eccentric_record, fitted, probability_of

OFFERED = ("viscous_damping", "cubic_stiffness", "sensor_offset", "encoder_eccentricity")


def coefficients(fit: ForceFit) -> dict[str, float]:
    """Those of eccentricity in the best law, of whatever width its prior is."""
    found: dict[str, float] = defaultdict(float)
    for column, value in zip(fit.law.columns, fit.coefficients, strict=True):
        if column.effect == "encoder_eccentricity":
            found[column.parameter] += value
    return found


def test_it_is_found_and_friction_with_it(rng: np.random.Generator) -> None:
    fit = fitted(eccentric_record(rng, 0.002), OFFERED, WHEEL)
    assert probability_of(fit, "encoder_eccentricity") > 0.99
    found = coefficients(fit)
    assert found["once_cosine"] == pytest.approx(0.002 * np.sin(0.7), rel=0.3)
    assert np.hypot(found["twice_sine"], found["twice_cosine"]) == pytest.approx(0.001, rel=0.3)
    assert fit.posterior.noise_sd == pytest.approx(WHEEL_NOISE, rel=0.1)
    assert fit.coefficients[fit.law.dry_friction] == pytest.approx(0.025, rel=0.05)


def test_a_misplaced_magnet_errs_by_an_order_of_magnitude_more(rng: np.random.Generator) -> None:
    fit = fitted(eccentric_record(rng, 0.08), OFFERED, WHEEL)
    assert probability_of(fit, "encoder_eccentricity") > 0.99
    assert coefficients(fit)["once_cosine"] == pytest.approx(0.08 * np.sin(0.7), rel=0.1)
    assert fit.coefficients[fit.law.dry_friction] == pytest.approx(0.025, rel=0.05)


def test_a_series_is_offered_as_its_extents_say(rng: np.random.Generator) -> None:
    law = fitted(eccentric_record(rng, 0.0), OFFERED, WHEEL).law
    offered = [
        (len(columns), {law.columns[j].width for j in columns})
        for columns in law.alternatives("encoder_eccentricity")
    ]
    assert offered == [(4, {1.0}), (8, {1.0}), (4, {10.0})]


def test_a_small_swing_cannot_tell_it_from_offset_and_gain(rng: np.random.Generator) -> None:
    fit = fitted(eccentric_record(rng, 0.002, release=0.4), OFFERED, WHEEL)
    assert not any("encoder_eccentricity" in names for names in fit.sets)


def test_a_sensor_of_displacement_has_no_turns() -> None:
    with pytest.raises(InputError, match="encoder_eccentricity"):
        fb.simulate(
            fb.Oscillator(mass=1.0, stiffness=100.0),
            friction=0.02,
            initial_displacement=0.02,
            duration=2.0,
            sampling_rate=100.0,
            effects={"encoder_eccentricity.once_sine": 0.001},
        )


def wandering_record(wander: float) -> xr.DataArray:
    """Record of an angle whose amplitude and phase wander as those of no law do."""
    t = np.arange(0.0, 15.0, 0.01)
    envelope = 1.0 + wander * np.sin(0.6 * math.pi * t) * np.sin(1.6 * math.pi * t + 1.0)
    angle = 1.2 * (1.0 - 0.04 * t) * envelope * np.cos(10.0 * t + wander * np.sin(math.pi * t))
    return fb.make_record(t, angle + 1e-3 * np.sin(1234.5 * np.arange(t.size) ** 2), "angle")


@pytest.mark.parametrize("wander", [0.45, 0.6])
def test_an_error_that_takes_the_place_of_the_motion_explains_nothing(wander: float) -> None:
    # an error of the angle, evaluated along the angle as it was read, follows every wander of it
    named = ["viscous_damping", "encoder_eccentricity", "random_force"]
    report = fb.close_loop([wandering_record(wander)], WHEEL, seed=1, check=False, effects=named)
    assert report.verdict == "unexplained"
    assert "encoder_eccentricity" not in report.effects
    # one such record is taken for noise behind a steep filter, which leaves a random force over
    assert {"forecast", "left_over"}.intersection(report.because)
