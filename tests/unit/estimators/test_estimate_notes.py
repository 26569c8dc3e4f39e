"""The notes of an estimate."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from decays import SYSTEM, short_decay


@pytest.mark.parametrize(
    ("quantity", "said"),
    [
        ("angle", "the stiffness is taken as exact: its uncertainty"),
        ("angular_velocity", "inertia and stiffness are taken as exact: their uncertainty"),
        ("angular_acceleration", "the inertia is taken as exact: its uncertainty"),
    ],
)
def test_what_is_taken_as_exact_is_named(quantity: str, said: str, seed: int) -> None:
    wheel = fb.Oscillator(inertia=0.05, stiffness=2.0)
    record = fb.simulate(
        wheel,
        friction=0.01,
        initial_displacement=0.3,
        duration=8.0,
        sampling_rate=100.0,
        noise_sd=1e-3,
        seed=seed,
        quantity=quantity,
    )
    assert any(note.startswith(said) for note in fb.estimate(record, wheel, method="envelope").notes)


def test_a_few_half_cycles_that_grow_are_reported() -> None:
    time = np.arange(0.0, 2.0, 0.01)
    record = fb.make_record(time, (0.01 + 0.002 * time) * np.cos(10.0 * time), "displacement")
    with pytest.raises(fb.InputError, match="friction is negative, which no contact has"):
        fb.estimate(record, SYSTEM)
    with pytest.warns(fb.RecordWarning, match="friction is negative"):
        estimate = fb.estimate(record, SYSTEM, method="envelope")
    assert estimate.friction.mean() < 0.0
    assert any(note.startswith("friction is negative") for note in estimate.notes)


def test_what_another_frequency_means_for_a_signal_of_no_scale() -> None:
    record = short_decay(duration=6.0, seed=5)
    video = fb.make_record(record["time"].values, record.values, "displacement", unit="px")
    wrong = fb.Oscillator(mass=2.0 * SYSTEM.mass, stiffness=SYSTEM.stiffness)
    with pytest.warns(fb.RecordWarning, match="friction in px does not depend on them, but a force"):
        estimate = fb.estimate(video, wrong, method="envelope")
    reported = fb.estimate(video, SYSTEM, method="envelope")
    assert estimate.friction.mean() == pytest.approx(reported.friction.mean(), rel=1e-6)
