"""Several records of one system, and effects that a user brings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numba import njit

import friction_bayes as fb
from decays import SYSTEM, long_decay
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.mechanics.effects import EFFECTS, ForceEffect, Parameter, SensorEffect, register
from friction_bayes.mechanics.effects.prior import half_normal, normal


def probability(report: Any, *names: str) -> float:
    return sum(c["probability"] for c in report.candidates if set(names) <= set(c["effects"]))


def test_a_second_release_amplitude_breaks_the_tie_of_viscous_damping_and_drift(seed: int) -> None:
    """Damping that is taken for a falling friction at one amplitude is not at half of it."""
    effects = {"viscous_damping.damping_ratio": 0.003}
    rivals = ["viscous_damping", "friction_drift"]
    high = long_decay(seed=seed, effects=effects)
    low = long_decay(seed=seed + 1, initial_displacement=0.03, effects=effects)
    alone = fb.close_loop([high], SYSTEM, seed=1, effects=rivals)
    together = fb.close_loop([high, low], SYSTEM, seed=1, effects=rivals)
    assert together.candidates[0]["effects"] == ["viscous_damping"]
    odds = [
        probability(r, "viscous_damping") / max(probability(r, "friction_drift"), 1e-9)
        for r in (alone, together)
    ]
    assert odds[1] > 20.0 * odds[0]
    assert together.friction_after["mean"] == pytest.approx(0.25, abs=4.0 * together.friction_after["sd"])
    assert len(together.traces) == 2
    assert "viscous_damping.damping_ratio" in together.posterior["posterior"]
    assert "displacement[1]" in together.posterior["posterior"]


def test_each_record_has_its_own_sensor_and_noise(seed: int) -> None:
    first = long_decay(seed=seed)
    second = long_decay(seed=seed + 1, noise_sd=1.5e-3, effects={"sensor_offset.offset": 0.004})
    report = fb.close_loop([first, second], SYSTEM, seed=1, effects=["sensor_offset"])
    assert report.candidates[0]["effects"] == ["sensor_offset"]
    offsets = report.effects[0]["parameters"]
    assert abs(offsets["offset[0]"]["mean"]) < 5.0 * offsets["offset[0]"]["sd"]
    assert offsets["offset[1]"]["mean"] == pytest.approx(0.004, abs=5.0 * offsets["offset[1]"]["sd"])


def test_records_that_disagree_are_refused_by_name() -> None:
    displacement = long_decay(seed=1).assign_attrs(name="first.csv")
    acceleration = long_decay(seed=2, quantity="acceleration", noise_sd=0.05).assign_attrs(name="second.csv")
    with pytest.raises(fb.InputError, match=r"second\.csv.*acceleration.*first\.csv.*displacement"):
        fb.close_loop([displacement, acceleration], SYSTEM, seed=1)
    with pytest.raises(fb.InputError, match="none given"):
        fb.close_loop([], SYSTEM, seed=1)


def saturated(share: float, noise_sd: float) -> xr.DataArray:
    """A decay whose sensor ends at a share of its largest signal, with noise on top of that."""
    record = long_decay(seed=1, noise_sd=0.0, quantity="displacement")
    level = share * float(np.max(np.abs(record.values)))
    noise = noise_sd * np.random.default_rng(1).standard_normal(record.size)
    values = np.clip(record.values, -level, level) + noise
    return fb.make_record(record["time"].values, values, "displacement").assign_attrs(name="flat.csv")


def test_tops_that_are_flat_below_noise_are_refused_as_by_estimate() -> None:
    record = saturated(0.7, 5e-4)
    said = []
    for refuse in (lambda: fb.estimate(record, SYSTEM), lambda: fb.close_loop([record], SYSTEM, seed=1)):
        with pytest.raises(fb.InputError, match=r"flat\.csv: the sensor saturates.*start.*range") as refused:
            refuse()
        said.append(str(refused.value))
    levels = [float(text.split("flat some ")[1].split()[0]) for text in said]
    assert levels == pytest.approx([0.7 * 0.05] * 2, rel=0.03)
    # without noise the flat samples are censored
    (segment,) = cut_records([saturated(0.7, 0.0)], SYSTEM)
    assert segment.clipped


@pytest.fixture
def own_effects() -> Iterator[None]:
    """What a user writes: one force with a shape, one fault of a sensor."""

    @njit
    def magnet(t, x, v, direction, friction, duration, mass, stiffness, p, i):  # type: ignore[no-untyped-def]
        return p[i] * v / (1.0 + (x / p[i + 1]) ** 2) if p[i + 1] > 0.0 else 0.0

    register(
        ForceEffect(
            name="eddy_brake",
            summary="c v / (1 + (x/l)^2)",
            parameters=(
                Parameter(name="coefficient", unit="N s/m", low=0.0, prior=lambda scales: half_normal(1.0)),
                Parameter(
                    name="length",
                    unit="m",
                    low=0.0,
                    open_low=True,
                    prior=lambda scales: half_normal(scales.amplitude),
                ),
            ),
            force=magnet,
        )
    )
    register(
        SensorEffect(
            name="warming_up",
            summary="+ a exp(-t/10 s)",
            parameters=(
                Parameter(name="error", unit="signal", prior=lambda scales: normal(0.1 * scales.signal)),
            ),
            distort=lambda signal, time, error: signal + error * np.exp(-time / 10.0),
        )
    )
    yield
    del EFFECTS["eddy_brake"], EFFECTS["warming_up"]


@pytest.mark.usefixtures("own_effects")
def test_a_users_effects_are_traced(seed: int) -> None:
    settings = {"eddy_brake.coefficient": 0.6, "eddy_brake.length": 0.02, "warming_up.error": 0.006}
    record = long_decay(seed=seed, effects=settings)
    effects = ["viscous_damping", "sensor_offset", "eddy_brake", "warming_up"]
    report = fb.close_loop([record], SYSTEM, seed=1, effects=effects)
    assert set(report.candidates[0]["effects"]) == {"eddy_brake", "warming_up"}
    traced = {effect["name"]: effect["parameters"] for effect in report.effects}
    for key, value in settings.items():
        name, _, parameter = key.partition(".")
        found = traced[name][parameter]
        assert found["mean"] == pytest.approx(value, abs=5.0 * found["sd"]), key
    assert traced["eddy_brake"]["coefficient"]["unit"] == "N s/m"
    assert traced["warming_up"]["error"]["unit"] == "m"


def test_an_error_that_is_not_linear_in_its_size_is_left_out_and_said(seed: int) -> None:
    register(
        SensorEffect(
            name="squared",
            summary="+ a^2",
            parameters=(
                Parameter(name="root", unit="signal", prior=lambda scales: normal(0.1 * scales.signal)),
            ),
            distort=lambda signal, time, root: signal + root**2,
        )
    )
    try:
        report = fb.close_loop([long_decay(seed=seed)], SYSTEM, effects=["viscous_damping", "squared"])
    finally:
        del EFFECTS["squared"]
    assert "squared was requested and not evaluated: it is not linear in its size" in report.notes
