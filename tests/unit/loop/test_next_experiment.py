"""What a further record would decide: against numerical integration, and against dense linear algebra."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from decays import SYSTEM, long_decay
from dense_force import dense_covariance
from experiments.simulation.simulated_fit import simulated_fit
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.report.next_experiment import (
    Contender,
    expected_log_bayes_factor,
    log_bayes_factor_of_scatter,
    next_experiment,
    proposals,
    rival_prediction,
)
from friction_bayes.statespace.kalman import Clock, sensor_row


@pytest.mark.parametrize("prior_sd", [0.05, 0.6, 3.0])
def test_expected_log_bayes_factor_is_the_integral(prior_sd: float) -> None:
    """Two samples and one parameter: log marginal likelihoods by quadrature, averaged over a grid of data."""
    difference, jacobian = np.array([1.4, -0.8]), np.array([[0.9], [1.7]])
    theta = np.linspace(-8.0 * prior_sd, 8.0 * prior_sd, 201)
    prior = stats.norm.pdf(theta, scale=prior_sd) * (theta[1] - theta[0])
    reach = 7.0 * math.hypot(1.0, 2.0 * prior_sd)
    axis = np.linspace(-reach, reach, 241)

    def marginal(centre: np.ndarray) -> np.ndarray:
        first, second = (
            stats.norm.pdf(axis[:, None] - mean - slope * theta)
            for mean, slope in zip(centre, jacobian[:, 0], strict=True)
        )
        return (first * prior) @ second.T

    first, second = marginal(difference), marginal(np.zeros(2))
    with np.errstate(divide="ignore", invalid="ignore"):
        integrand = np.where(first > 1e-250, first * (np.log(first) - np.log(second)), 0.0)
    expected = float(integrand.sum()) * (axis[1] - axis[0]) ** 2
    found = expected_log_bayes_factor(difference, jacobian, np.array([[prior_sd**2]]))
    assert found == pytest.approx(expected, rel=1e-4)


def fitted(*effects: str) -> Contender:
    record = long_decay(duration=6.0, seed=5, effects={"viscous_damping.damping_ratio": 0.002})
    fit = simulated_fit(cut_records([record], SYSTEM)[0], SYSTEM, effects, {})
    return Contender(model=fit.model, z=fit.z, covariance=fit.covariance, noise_sd=fit.noises[0].sd)


@pytest.fixture(scope="module")
def tied() -> tuple[Contender, Contender]:
    return fitted("viscous_damping"), fitted("friction_drift")


def test_scores_are_those_of_the_predictive_distributions(tied: tuple[Contender, Contender]) -> None:
    """The whole covariance of the rival's prediction, by central differences of its own parameters."""
    truth, rival = tied
    names = [c.name for c in rival.model.coordinates]
    law = [names.index(name) for name in ("friction", "log_frequency_ratio", "relative_change")]
    for proposal in proposals(truth, rival):
        largest, time = proposal.largest, proposal.time

        def signal(fit: Contender, law_shift: np.ndarray, state_shift: np.ndarray) -> np.ndarray:
            z = fit.z.copy()
            z[law] += law_shift
            state = (largest * (1.0 + state_shift[0]), 10.0 * largest * state_shift[1])  # noqa: B023
            prediction = fit.model.predict_at(z, 0, time, state, proposal.order)  # noqa: B023
            assert prediction is not None
            return prediction.signal

        nothing = np.zeros(3), np.zeros(2)
        target, base = (signal(fit, *nothing) for fit in tied)
        columns = []
        for i, step in enumerate([2e-4, 2e-4, 2e-4, 2e-5, 2e-5]):
            shift = step * np.eye(5)[i]
            ends = (signal(rival, s[:3], s[3:]) for s in (shift, -shift))
            columns.append(np.subtract(*ends) / (2.0 * step))
        jacobian = np.column_stack(columns)
        covariance = np.diag([0.0, 0.0, 0.0, 0.01, 0.01])
        covariance[:3, :3] = rival.covariance[np.ix_(law, law)]
        # natural frequency 10 rad/s: the same noise in the acceleration is a hundred times as large
        sd = truth.noise_sd * 10.0**proposal.order
        predictive = sd**2 * np.eye(time.size) + jacobian @ covariance @ jacobian.T
        predicted = rival_prediction(rival, proposal)
        assert predicted is not None
        if proposal.order == 0:
            # a score hardly depends on the size of columns that the record itself determines: each by itself
            for found, column in zip(predicted[1].T, columns, strict=True):
                assert np.linalg.norm(found - column) < 0.02 * np.linalg.norm(column), proposal.what
        expected = 0.5 * (target - base) @ np.linalg.solve(predictive, target - base)
        # the jumps of the acceleration at the turning points have no derivative
        tolerance = 0.2 if proposal.order == 2 else 0.02
        assert proposal.log_bayes_factor == pytest.approx(expected, rel=tolerance), proposal.what


def test_the_sentence_names_the_proposal_that_decides_best(tied: tuple[Contender, Contender]) -> None:
    best = max(proposals(*tied), key=lambda proposal: proposal.log_bayes_factor)
    sentence = next_experiment(tied, ["viscous damping", "friction drift"])
    assert sentence is not None
    assert best.what in sentence
    assert sentence.startswith("Add" if best.log_bayes_factor > math.log(20.0) else "No single")


def test_with_two_rivals_the_worse_decided_one_counts(tied: tuple[Contender, Contender]) -> None:
    """A candidate compared with itself is decided by no record."""
    sentence = next_experiment([*tied, tied[0]], ["viscous damping", "friction drift", "its double"])
    assert sentence is not None
    assert sentence.startswith(
        "No single further record is expected to separate viscous damping from friction drift or its double; "
        "friction differs"
    )


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize(
    "forces", [((3.0, 0.4), (0.0, 1.0)), ((0.0, 1.0), (2.0, 3.0)), ((1.0, 0.3), (3.0, 2.0))]
)
def test_scatter_is_separated_as_dense_covariances_say(
    forces: tuple[tuple[float, float], tuple[float, float]], order: int
) -> None:
    """Half of ``tr(inv(V2) V1) - n + log |V2| / |V1|``, the uncertainty of the law in both."""
    phase = 0.3 * np.arange(60)
    row = sensor_row(order)
    jacobian = np.column_stack([np.cos(phase), 0.1 * phase * np.sin(phase)])
    covariance = np.array([[4.0, 0.6], [0.6, 0.5]])
    law = np.eye(phase.size) + jacobian @ covariance @ jacobian.T

    def record(force: tuple[float, float]) -> np.ndarray:
        states = dense_covariance(phase, np.ones(phase.size - 1), force[1]).reshape(
            phase.size, 3, phase.size, 3
        )
        return np.asarray(law + force[0] ** 2 * np.einsum("a,iajb,b->ij", row, states, row))

    first, second = (record(force) for force in forces)
    matrix = np.linalg.solve(second, first)
    expected = 0.5 * (np.trace(matrix) - phase.size - np.linalg.slogdet(matrix)[1])
    # scatter of the mean over the simulated records
    excess = matrix - np.eye(phase.size)
    error = math.sqrt(0.5 * float(np.trace(excess @ excess)) / 100)
    found = log_bayes_factor_of_scatter(jacobian, covariance, Clock.of(phase), row, *forces)
    assert 4.0 * error < expected
    assert abs(found - expected) < 4.0 * error
