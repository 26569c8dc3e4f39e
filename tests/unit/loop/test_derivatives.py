"""Derivatives of a model's signal in its coordinates against differences of whole simulations."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.core.arrays import Array
from friction_bayes.loop.data import model as loop_model
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import SHARED, VELOCITY
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.data.starting_point import starting_point
from friction_bayes.loop.search.derivatives import predict_with_derivatives

LINEAR = fb.Oscillator(inertia=0.5, stiffness=20.0)
PENDULUM = fb.Pendulum(inertia=0.5, stiffness=20.0)


def model_of(system: fb.Oscillator, quantity: str, effects: tuple[str, ...], records: int = 1) -> LoopModel:
    several = [
        fb.simulate(
            system,
            friction=0.2,
            initial_displacement=1.2 - 0.3 * r,
            duration=12.0,
            sampling_rate=80.0,
            quantity=quantity,
            noise_sd=1e-4,
            seed=r,
        )
        for r in range(records)
    ]
    return LoopModel(system, cut_records(several, system), effects)


def ordinary(model: LoopModel) -> Array:
    """The start of a fit, in mid-motion, each effect at a score of 0.4 of its prior."""
    z = starting_point(model)
    for j, c in enumerate(model.coordinates):
        if c.effect:
            z[j] = c.at_score(0.4)
        elif c.name == VELOCITY:
            # a turning point at the first sample would pass it
            z[j] = 0.1
    return z


@pytest.fixture(autouse=True)
def integrated_tightly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loop_model, "RTOL", 1e-13)


@pytest.mark.parametrize("system", [LINEAR, PENDULUM], ids=["linear", "pendulum"])
@pytest.mark.parametrize("quantity", ["angle", "angular_velocity", "angular_acceleration"])
def test_every_coordinate(system: fb.Oscillator, quantity: str) -> None:
    effects = (
        "viscous_damping",
        "stribeck_friction",
        "cubic_stiffness",
        "sensor_nonlinearity",
        "sensor_offset",
    )
    model = model_of(system, quantity, (*effects, "periodic_interference"))
    z = ordinary(model)
    predicted = predict_with_derivatives(model, z, 0)
    assert predicted is not None
    prediction, derivatives = predicted
    plain = model.predict(z, 0)
    assert plain is not None
    np.testing.assert_array_equal(prediction.signal, plain.signal)
    time = model.segments[0].time
    clear = np.min(np.abs(time[:, None] - plain.turning_times), axis=1) > 0.01
    for j, c in enumerate(model.coordinates):
        # a line of interference turns by half the sampling rate times the duration in one coordinate
        step = 1e-7 if c.name == "frequency" else 3e-4
        signals = {}
        for k in (-2, -1, 1, 2):
            moved = z.copy()
            moved[j] += k * step
            other = model.predict(moved, 0)
            assert other is not None
            signals[k] = other.signal
        expected = (8.0 * (signals[1] - signals[-1]) - (signals[2] - signals[-2])) / (12.0 * step)
        error = np.max(np.abs(derivatives[:, j] - expected)[clear]) / np.max(np.abs(expected))
        assert error < 1e-6, f"{c.label} is wrong by {error:.1e}"


def test_what_belongs_to_another_record_is_zero_and_the_rest_as_asked_for() -> None:
    model = model_of(LINEAR, "angle", ("viscous_damping", "friction_drift", "sensor_offset"), records=2)
    z = ordinary(model)
    for r in range(2):
        predicted = predict_with_derivatives(model, z, r)
        assert predicted is not None
        own = np.array([c.record in (SHARED, r) for c in model.coordinates])
        assert np.array_equal(predicted[1].any(axis=0), own)
        some = [5, 0, 3]
        chosen = predict_with_derivatives(model, z, r, coordinates=some)
        assert chosen is not None
        np.testing.assert_array_equal(chosen[1], predicted[1][:, some])


def test_a_motion_that_does_not_stay_finite_has_none() -> None:
    model = model_of(LINEAR, "angle", ("cubic_stiffness",))
    z = ordinary(model)
    z[model.index("cubic_stiffness", effect="cubic_stiffness")] = -1e6
    assert predict_with_derivatives(model, z, 0) is None
