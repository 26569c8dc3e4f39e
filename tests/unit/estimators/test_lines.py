"""Interference and other modes, which a fit takes out and says so."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from eighteen_half_cycles import AMPLITUDE, SYSTEM, UNIT, plain_estimate, record, width
from friction_bayes.core.arrays import Array

MAINS = 2.0 * np.pi * 50.0


def with_wave(quantity: str, wave: Array, seed: int = 1) -> xr.DataArray:
    plain = record(quantity, seed)
    return plain.copy(data=plain.values + AMPLITUDE * UNIT[quantity] * wave)


def time() -> Array:
    return np.asarray(record()["time"].values)


@pytest.mark.parametrize("quantity", list(UNIT))
def test_friction_is_known_as_well_as_without_a_hum(quantity: str) -> None:
    """Of the mains, ten times the noise, with a harmonic."""
    hum = 0.02 * np.sin(MAINS * time() + 1.0) + 0.005 * np.sin(1.7 * MAINS * time())
    clean, found = plain_estimate(quantity), fb.estimate(with_wave(quantity, hum), SYSTEM)
    assert sorted(found.decay.lines) == pytest.approx([50.0, 85.0], abs=0.05)
    assert found.friction.mean() == pytest.approx(clean.friction.mean(), abs=0.3 * width(clean))
    assert width(found) < 1.1 * width(clean)
    assert any("as of the mains, or another mode at 50 and 85 Hz" in note for note in found.notes)


def test_another_mode_that_dies_out_is_taken_out_too() -> None:
    ringing = 0.03 * np.exp(-time() / 0.6) * np.cos(47.0 * time())
    clean = plain_estimate("acceleration")
    found = fb.estimate(with_wave("acceleration", ringing), SYSTEM)
    assert found.decay.lines == pytest.approx((47.0 / (2.0 * np.pi),), abs=0.2)
    assert found.friction.mean() == pytest.approx(clean.friction.mean(), abs=width(clean))
    assert width(found) < 1.5 * width(clean)


def test_stray_samples_are_found_that_a_hum_hides() -> None:
    values = with_wave("displacement", 0.05 * np.sin(MAINS * time()))
    values[100] += 0.03 * AMPLITUDE
    found = fb.estimate(values, SYSTEM)
    assert found.decay.stray == pytest.approx((float(values["time"][100]),))
    assert width(found) < 1.1 * width(plain_estimate())


def test_one_record_and_a_batch_take_out_the_same() -> None:
    hum = with_wave("displacement", 0.02 * np.sin(MAINS * time()))
    with pytest.warns(fb.RecordWarning, match="interference, another mode or a drift .* is taken out: 1"):
        batch = fb.estimate_batch(xr.concat([record(), hum], "record"), SYSTEM)
    assert float(batch["friction_mean"][1]) == pytest.approx(
        fb.estimate(hum, SYSTEM).friction.mean(), rel=1e-10
    )
