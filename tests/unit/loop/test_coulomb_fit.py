"""Coulomb friction alone, fitted by simulation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

import friction_bayes as fb
from decays import SYSTEM, long_decay
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.coulomb_fit import fit_coulomb


def squares(fit: object, z: np.ndarray) -> float:
    """Sum of squared residuals over all records, with the prior, in units of the noise."""
    total = 0.0
    for r, segment in enumerate(fit.model.segments):
        residual = (segment.values - fit.model.predict(z, r).signal)[segment.free]
        total += residual.size * np.log(residual @ residual)
    return float(total + z @ z)


@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
def test_the_mode_is_that_of_a_search_without_derivatives(quantity: str) -> None:
    noise = {"displacement": 5e-4, "velocity": 5e-3, "acceleration": 0.05}[quantity]
    record = long_decay(duration=6.0, seed=3, quantity=quantity, noise_sd=noise)
    fit = fit_coulomb(SYSTEM, cut_records([record], SYSTEM))
    sd = np.sqrt(np.diag(fit.covariance))
    # a step of half a standard deviation in any direction raises minus twice the logarithm by a quarter
    for j in range(fit.z.size):
        for side in (-0.5, 0.5):
            moved = fit.z.copy()
            moved[j] += side * sd[j]
            assert squares(fit, moved) > squares(fit, fit.z)


def test_curvature_is_that_of_least_squares() -> None:
    record = long_decay(duration=6.0, seed=3)
    fit = fit_coulomb(SYSTEM, cut_records([record], SYSTEM))
    segment = fit.model.segments[0]
    noise = np.std(fit.free_residuals[0])

    def residual(z: np.ndarray) -> np.ndarray:
        return (segment.values - fit.model.predict(z, 0).signal) / noise

    reference = least_squares(residual, fit.z, diff_step=1e-5, x_scale=np.sqrt(np.diag(fit.covariance)))
    assert np.all(np.abs(reference.x - fit.z) < 0.05 * np.sqrt(np.diag(fit.covariance)))
    expected = np.linalg.inv(reference.jac.T @ reference.jac + np.eye(fit.z.size))
    np.testing.assert_allclose(np.diag(fit.covariance), np.diag(expected), rtol=0.03)


def test_records_share_friction_and_have_their_own_noise() -> None:
    quiet = long_decay(duration=6.0, seed=4, noise_sd=1e-5)
    loud = long_decay(duration=6.0, seed=5, noise_sd=1e-3)
    both = fit_coulomb(SYSTEM, cut_records([quiet, loud], SYSTEM))
    alone = fit_coulomb(SYSTEM, cut_records([quiet], SYSTEM))
    # the prior's unit is the amplitude of the records; the loud one adds a ten-thousandth of the information
    each = [fit.friction(np.random.default_rng(1), 20_000) for fit in (both, alone)]
    assert abs(each[0].mean() - each[1].mean()) < 0.2 * each[1].std()
    assert each[0].std() == pytest.approx(each[1].std(), rel=0.05)


def test_a_motion_that_stops_within_the_record_is_followed() -> None:
    record = long_decay(duration=12.0, friction=0.8, seed=6)
    fit = fit_coulomb(SYSTEM, cut_records([record], SYSTEM))
    assert np.isfinite(fit.predictions[0].stop_time)
    assert fit.model.value(fit.z, "friction") == pytest.approx(0.8, rel=0.01)


def test_a_motion_that_does_not_stay_finite_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    segments = cut_records([long_decay(duration=6.0, seed=3)], SYSTEM)
    monkeypatch.setattr(LoopModel, "predict", lambda *_: None)
    with pytest.raises(fb.InputError, match="no free decay under dry friction fits"):
        fit_coulomb(SYSTEM, segments)


def test_the_others_move_on_where_one_is_at_its_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """Friction may not fall below twice the truth: the mode is then that of the others, given that."""
    segments = cut_records([long_decay(duration=6.0, seed=3)], SYSTEM)
    low, high = LoopModel(SYSTEM, segments).bounds
    j = LoopModel(SYSTEM, segments).index("friction")
    low[j] = LoopModel(SYSTEM, segments).coordinates[j].coordinate(0.5)
    rest = LoopModel(SYSTEM, segments, ("sensor_offset",)).bounds[0].size - low.size
    ends = np.append(low, np.full(rest, -np.inf)), np.append(high, np.full(rest, np.inf))
    monkeypatch.setattr(LoopModel, "bounds", ends)
    fit = fit_coulomb(SYSTEM, segments)
    assert fit.model.value(fit.z, "friction") == pytest.approx(0.5)
    gradient = fit.curvature(None)[1]
    assert gradient[j] < 0.0
    sd = np.sqrt(np.diag(fit.covariance))
    for other in np.delete(np.arange(fit.z.size), j):
        for side in (-0.5, 0.5):
            moved = fit.z.copy()
            moved[other] += side * sd[other]
            assert squares(fit, moved) > squares(fit, fit.z)
