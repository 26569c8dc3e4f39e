"""The envelope estimator: exact data, prior and posterior, target, and what it refuses."""

import numpy as np
import pytest
from scipy import stats

from decays import SYSTEM
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES, inverse_square
from friction_bayes.core.system import Pendulum
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.phase_tracking import track_phase
from friction_bayes.estimators.envelope.estimator import ENVELOPE_COEFFICIENTS, EnvelopeEstimator
from friction_bayes.estimators.envelope.half_cycle_rows import envelope_statistics, half_cycle_rows
from friction_bayes.mechanics.coulomb import coulomb_decay

ENVELOPE = EnvelopeEstimator()
FRICTION = 0.07
NAMES = ("displacement", "velocity", "acceleration")


def paper_decay(
    order: int,
    *,
    noise: float = 0.0,
    seed: int = 0,
    step: float = 0.001,
    offset: float = 0.0,
    start: float = 0.05,
) -> tuple[FreeDecay, np.ndarray]:
    """The paper's example from ``start`` seconds after its release, and the same without noise and offset."""
    t = np.arange(0.0, 32.0, step) + start
    motion = coulomb_decay(SYSTEM, FRICTION, 0.0147, 0.0, np.concatenate([[0.0], t]))
    clean = (motion.displacement, motion.velocity, motion.acceleration)[order][1:]
    sd = noise * SYSTEM.natural_frequency**order
    values = clean + offset + np.random.default_rng(seed).normal(0.0, sd, t.size)
    quantity = QUANTITIES[NAMES[order]]
    decay = FreeDecay(
        name="paper",
        values=values,
        start_time=0.0,
        step=step,
        quantity=quantity,
        unit=quantity.unit,
        system=SYSTEM,
        frequency=10.05,
        phase=10.0 * start + 0.1,
        rest_position=0.0,
        stops=False,
    )
    return decay, clean


@pytest.mark.parametrize("step", [0.001, 0.02, 0.17])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_exact_without_noise(order: int, step: float) -> None:
    decay, clean = paper_decay(order, step=step, offset=0.5)
    fit = ENVELOPE.fit(decay, ENVELOPE.default_prior(decay) | {"beta": 1e-30}, peaks="highest")
    factor = SYSTEM.force_factor(decay.quantity)
    assert fit.coefficient.mean() * factor == pytest.approx(FRICTION, rel=1e-7)
    assert fit.rest_position == pytest.approx(0.5, abs=1e-9)
    assert fit.frequency == pytest.approx(10.0, rel=1e-8)
    # what the prior of precision 1e-12 makes of coefficients of 0.5
    assert fit.noise_sd < 1e-6
    # at 1.8 samples a half cycle four are taken together
    assert fit.amplitudes == (102 if step < 0.1 else 26)
    np.testing.assert_allclose(fit.prediction, clean + 0.5, atol=1e-8)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_noisy_record(order: int, seed: int) -> None:
    decay, clean = paper_decay(order, noise=5e-4, seed=seed, offset=0.1)
    fit = ENVELOPE.fit(decay, ENVELOPE.default_prior(decay), peaks="highest")
    factor = SYSTEM.force_factor(decay.quantity)
    sd = 5e-4 * 10.0**order
    # the Cramer-Rao bound is 0.094 % here; 5 of them, and 5 of the noise level's sqrt(1/2N)
    assert fit.coefficient.mean() * factor == pytest.approx(FRICTION, rel=5 * 0.00094)
    assert fit.coefficient.std() * factor == pytest.approx(0.00094 * FRICTION, rel=0.4)
    assert fit.noise_sd == pytest.approx(sd, rel=5 / np.sqrt(204))
    assert fit.precision.mean() ** -0.5 == pytest.approx(fit.noise_sd, rel=0.02)
    assert fit.precision_unit == inverse_square(decay.unit)
    assert fit.frequency == pytest.approx(10.0, abs=2e-4)
    # 3 + 6 fitted numbers of 32000 samples; an acceleration may be put on the wrong side of a jump
    assert np.sqrt(np.mean((fit.prediction - clean - 0.1) ** 2)) < (0.05 if order < 2 else 0.1) * sd
    theta = fit.target.centre + np.random.default_rng(1).normal(size=(20, 4)) * np.sqrt(
        np.diag(fit.target.covariance)
    )
    assert np.ptp(fit.target.log_prob(theta) - fit.target.closed_form(theta)) < 1e-8
    drawn = fit.target.posterior(fit.target.centre[None])
    assert drawn["friction"][0] == pytest.approx(fit.coefficient.mean() * factor)
    assert set(drawn) == {"friction", ENVELOPE_COEFFICIENTS[0], ENVELOPE_COEFFICIENTS[2], "precision"}
    assert fit.target.observed.size == fit.amplitudes + 1


def test_projections_are_white_and_of_the_samples_variance(rng: np.random.Generator) -> None:
    # unit noise of the samples stays unit noise of the projections, uncorrelated, on an oblique grid too
    t = np.arange(600) * 0.037
    polynomial = track_phase(np.cos(10.0 * t), 0.037, 10.0, 0.0, 0, False)
    noise = rng.normal(size=(2000, t.size))
    rows = np.array([half_cycle_rows(values, polynomial, 0, 0.0)[0] for values in noise])
    covariance = np.cov(rows.T)
    # entries have sd sqrt(1/2000) = 0.022 (diagonal sqrt(2) of that); 800 distinct of them, 6 sd: 2e-6
    np.testing.assert_allclose(covariance, np.eye(rows.shape[1]), atol=6 * np.sqrt(2 / 2000))


def test_batch_of_records_says_the_same(seed: int) -> None:
    decays = [paper_decay(1, noise=5e-4, seed=seed + k, step=0.02)[0] for k in range(3)]
    records = np.stack([d.values for d in decays])
    records[2, 5] = np.nan
    gram, found, residual, rows, _ = envelope_statistics(
        records,
        0.02,
        np.full(3, 10.05),
        np.full(3, 0.6),
        np.zeros(3, int),
        np.full(3, records.shape[1]),
        1,
        0.0,
    )
    for k in range(2):
        fit = ENVELOPE.fit(
            decays[k], {"coefficient_precision": 0.0, "alpha": -1.5, "beta": 0.0}, peaks="highest"
        )
        np.testing.assert_allclose(found[k], fit.posterior.mean, rtol=1e-7, atol=1e-12)
        np.testing.assert_allclose(gram[k], fit.posterior.precision, rtol=1e-6, atol=1e-6 * gram[k].max())
        assert 0.5 * residual[k] == pytest.approx(fit.posterior.beta, rel=1e-7)
        assert fit.posterior.alpha == 0.5 * (rows[k] - 3)
    assert np.all(np.isnan(found[2]))


def test_skipped_record_is_not_determined() -> None:
    _, found, residual, rows, _ = envelope_statistics(
        np.zeros((1, 100)), 0.01, np.array([10.0]), np.array([0.0]), np.array([50]), np.array([50]), 0, 0.0
    )
    assert np.isnan(found).all()
    assert np.isnan(residual[0])
    assert rows[0] == 0


def test_prior_counts(seed: int) -> None:
    decay, _ = paper_decay(0, noise=5e-4, seed=seed)
    default = ENVELOPE.default_prior(decay)
    assert tuple(default) == ENVELOPE.prior_keys
    assert (
        ENVELOPE.fit(decay, default, peaks="nominal").coefficient.mean()
        == ENVELOPE.fit(decay, default, peaks="highest").coefficient.mean()
    )
    tight = ENVELOPE.fit(decay, default | {"coefficient_precision": 1e12}, peaks="highest")
    assert tight.coefficient.mean() == pytest.approx(0.0, abs=1e-6)


def test_an_uncalibrated_pendulum_is_said_to_be_taken_as_small(seed: int) -> None:
    decay, _ = paper_decay(1, noise=5e-4, seed=seed)
    fields = {k: v for k, v in vars(decay).items() if k not in ("system", "quantity", "unit")}
    volts = FreeDecay(
        **fields,
        system=Pendulum(inertia=10.0, stiffness=1000.0),
        quantity=QUANTITIES["angular_velocity"],
        unit="V",
    )
    fit = ENVELOPE.fit(volts, ENVELOPE.default_prior(volts), peaks="highest")
    assert any("swings of the pendulum are taken as small" in note for note in fit.notes)
    assert fit.coefficient.mean() == pytest.approx(10.0 * FRICTION / 1000.0, rel=0.005)


def test_refusals() -> None:
    decay, _ = paper_decay(1)
    fields = {k: v for k, v in vars(decay).items() if k not in ("values",)}
    with pytest.raises(
        InputError, match=r"paper: .* half cycles could be fitted, with .* data for three unknowns"
    ):
        ENVELOPE.fit(FreeDecay(**fields, values=decay.values[:400]), {}, peaks="highest")
    fields |= {
        "system": Pendulum(inertia=1.0, stiffness=100.0),
        "quantity": QUANTITIES["angular_acceleration"],
        "unit": "rad/s2",
    }
    with pytest.raises(InputError, match="does not give the amplitude of swings this large"):
        ENVELOPE.fit(FreeDecay(**fields, values=decay.values * 2000.0), {}, peaks="highest")


def test_coefficient_is_a_student_t(seed: int) -> None:
    decay, _ = paper_decay(0, noise=5e-4, seed=seed)
    fit = ENVELOPE.fit(decay, ENVELOPE.default_prior(decay), peaks="highest")
    df = fit.amplitudes + 1 - 2.5
    scale = fit.coefficient.std() / np.sqrt(df / (df - 2))
    np.testing.assert_allclose(
        fit.coefficient.ppf([0.05, 0.5, 0.95]),
        stats.t.ppf([0.05, 0.5, 0.95], df, fit.coefficient.mean(), scale),
    )
