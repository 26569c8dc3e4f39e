"""Several free decays in one recording: found, separated from what else rises, and cut."""

from __future__ import annotations

import numpy as np
import pytest

from decays import SYSTEM, recording_of_decays, written_decay
from friction_bayes import InputError, estimate, estimate_batch, make_record, split_decays
from friction_bayes.core.arrays import Array
from friction_bayes.estimators.batch import STATUS

RELEASES = (1.2, 10.4, 19.6)


def recorded(signal: Array, noise_sd: float, rng: np.random.Generator) -> Array:
    return signal + rng.normal(0.0, noise_sd, signal.size)


@pytest.mark.parametrize("noise_sd", [1e-5, 1e-4, 1e-3])
def test_each_release_is_a_record(noise_sd: float, rng: np.random.Generator) -> None:
    signal = recorded(recording_of_decays(), noise_sd, rng)
    record = make_record(np.arange(signal.size) / 100.0, signal, "displacement", name="three.csv")
    decays = split_decays(record, SYSTEM)
    assert [each.attrs["name"] for each in decays] == [f"three.csv decay {k}" for k in (1, 2, 3)]
    for each, release in zip(decays, RELEASES, strict=True):
        found = estimate(each, SYSTEM, random_force="none")
        assert found.decay.start_time == pytest.approx(release, abs=0.2)
        assert abs(found.friction.mean() - 0.5) < 4.0 * found.friction.std()


def test_the_derivatives_have_the_same_decays(rng: np.random.Generator) -> None:
    signal = recording_of_decays(rate=1000.0)
    for quantity, order in (("velocity", 1), ("acceleration", 2)):
        derivative = signal
        for _ in range(order):
            derivative = np.gradient(derivative, 1e-3)
        noisy = recorded(derivative, 1e-3 * 10.0**order, rng)
        record = make_record(np.arange(signal.size) / 1000.0, noisy, quantity)
        assert len(split_decays(record, SYSTEM)) == 3


def test_nothing_is_estimated_of_several_at_once(rng: np.random.Generator) -> None:
    signal = recorded(recording_of_decays((0.02, 0.015)), 1e-4, rng)
    record = make_record(np.arange(signal.size) / 100.0, signal, "displacement")
    with pytest.raises(
        InputError, match=r"holds 2 free decays, 1: 1\.\d+ to 7\.\d+ s \(.. half cycles\), 2: "
    ):
        estimate(record, SYSTEM)
    both = np.stack([signal, np.resize(recording_of_decays((0.02,)), signal.size)])
    both[1, 920:] = both[1, 919]
    status = estimate_batch(both, SYSTEM, sampling_rate=100.0, judge=False)["status"].values
    assert [STATUS[k] for k in status] == ["several_decays", "ok"]


def test_a_recording_that_pauses_between_releases_holds_one_after_each_pause(
    rng: np.random.Generator,
) -> None:
    """As one that is triggered: what was missing in between is no part of any, nor is a stretch of rest."""
    whole = recording_of_decays()
    time = np.arange(whole.size) / 100.0
    running = (time > 1.3) & (time < 6.0) | (time > 10.5) & (time < 15.0) | (time > 19.7)
    record = make_record(
        np.append(time[running], time[-1] + 30.0 + 0.01 * np.arange(300)),
        recorded(np.append(whole[running], np.full(300, whole[-1])), 1e-4, rng),
        "displacement",
        name="three.csv",
    )
    decays = split_decays(record, SYSTEM)
    assert [each.attrs["name"] for each in decays] == [f"three.csv decay {k}" for k in (1, 2, 3)]
    for each in decays:
        friction = estimate(each, SYSTEM, random_force="none").friction
        assert abs(friction.mean() - 0.5) < 4.0 * friction.std()
    with pytest.raises(
        InputError, match=r"gap of .* where the recording pauses between releases, .* by split_decays\("
    ):
        estimate(record, SYSTEM)


TIME = np.arange(4000) / 100.0


@pytest.mark.parametrize(
    "signal",
    [
        written_decay(np.minimum(TIME, 20.0 * np.pi / 10.0), 0.02, 5e-4),
        0.015 * np.exp(-0.03 * TIME) * (np.cos(10.0 * TIME) + 0.9 * np.cos(10.6 * TIME)),
        np.where(TIME < 8.0, 0.02 * np.exp(-0.2 * TIME) * np.cos(10.0 * TIME), 0.01 * (TIME > 20.0)),
        0.02 * np.exp(-0.2 * TIME) * np.cos(10.0 * TIME) + 0.003 * np.sin(17.0 * TIME),
    ],
    ids=["one", "beat", "a step of the rest position", "interference"],
)
def test_what_else_rises_is_no_decay(signal: Array, rng: np.random.Generator) -> None:
    for noise_sd in (1e-5, 5e-4):
        record = make_record(TIME, recorded(signal, noise_sd, rng), "displacement")
        (found,) = split_decays(record, SYSTEM)
        assert found is record
