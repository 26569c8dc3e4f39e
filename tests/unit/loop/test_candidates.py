"""What the candidates of one record and of several owe the report."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from decays import SYSTEM, fluctuating_friction, slow_decay
from friction_bayes.loop.checks import forecast
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.law_draws import DRAWS, DrawnLaws, draw_laws
from friction_bayes.loop.mixture.candidates import Candidates, candidates_of
from friction_bayes.loop.mixture.mixture import CandidateMixture, Cells
from friction_bayes.loop.report.next_experiment import drawn_contender
from loop_options import loop_options

ALLOWED = ("viscous_damping", "quadratic_drag", "sensor_offset", "random_force")
LEFT = {
    "record",
    "structured_rms",
    "share_of_amplitude",
    "friction_could_shift_by",
    "depends_on",
    "shape",
    "share",
    "unit",
}


def releases(count: int, share: float = 0.3, noise_sd: float = 1e-5):  # type: ignore[no-untyped-def]
    """Decays with viscous damping and a random force; the sensors are off their zeros."""
    records = [
        slow_decay(
            duration=10.0,
            sampling_rate=50.0,
            noise_sd=noise_sd,
            seed=3 + k,
            effects=(fluctuating_friction(share) if share else {})
            | {"viscous_damping.damping_ratio": 0.004, "sensor_offset.offset": 1e-3 * (k + 1)},
        )
        for k in range(count)
    ]
    return cut_records(records, SYSTEM)


def alone(noise_sd: float = 1e-5) -> Candidates:
    """Without a random force, which may not act."""
    (segment,), options = releases(1, 0.0, noise_sd), loop_options(ALLOWED, random_force="none")
    return candidates_of((segment,), SYSTEM, options, np.random.default_rng(1))


def forced() -> Candidates:
    return candidates_of(releases(1), SYSTEM, loop_options(ALLOWED), np.random.default_rng(2))


def together(share: float = 0.3) -> Candidates:
    rng, options = np.random.default_rng(3), loop_options(ALLOWED)
    return candidates_of(releases(2, share), SYSTEM, options, rng)


@pytest.fixture(scope="module", params=[alone, forced, together])
def candidates(request: pytest.FixtureRequest) -> Candidates:
    return request.param()  # type: ignore[no-any-return]


@pytest.fixture(scope="module")
def joint() -> Candidates:
    return together()


def records(candidates: Candidates) -> int:
    return len(candidates.fit.fits)


def test_candidates_are_ranked_and_drawn_by_their_evidence(candidates: Candidates) -> None:
    shares = candidates.probabilities
    assert len(set(candidates.sets)) == len(candidates.sets) == len(shares)
    assert frozenset() in candidates.sets
    assert np.all(np.diff(shares) <= 0.0)
    assert shares.sum() == pytest.approx(1.0)
    drawn = candidates.mixture
    own = vars(drawn).keys() - {"sets", "probabilities"}
    assert all(len(getattr(drawn, name)) == DRAWS for name in own)
    assert drawn.candidate.min() >= 0
    for i, p in enumerate(shares):
        # five standard errors, and what cells below 1e-4 hold together
        assert abs(np.mean(drawn.candidate == i) - p) < 5.0 * np.sqrt(p * (1.0 - p) / DRAWS) + 0.02
    forced = np.array(["random_force" in names for names in candidates.sets])
    np.testing.assert_array_equal(drawn.random_force > 0.0, forced[drawn.candidate])
    assert drawn.friction.min() >= 0.0
    assert candidates.laws.frequency.mean() == pytest.approx(SYSTEM.natural_frequency, rel=1e-2)
    assert candidates.by_all_sets.mean() == pytest.approx(drawn.friction.mean(), rel=0.2)


def test_parameters_are_summaries_of_the_variables(candidates: Candidates) -> None:
    variables = candidates.variables()
    count = np.count_nonzero(candidates.mixture.candidate == 0)
    assert {"friction", "log_frequency_ratio"} <= set(variables)
    assert all(values.shape == (count,) for values in variables.values())
    for name in candidates.sets[0]:
        parameters = candidates.parameters(name)
        assert parameters
        for parameter, found in parameters.items():
            draws = variables[f"{name}.{parameter}"]
            assert found["mean"] == pytest.approx(float(draws.mean()))
            assert found["sd"] == pytest.approx(float(draws.std(ddof=1)))


def test_each_record_is_traced_and_forecast(candidates: Candidates) -> None:
    traces, forecasts = candidates.traces, candidates.forecasts
    assert len(traces) == len(forecasts) == records(candidates)
    assert traces[0].turning_points.size == candidates.best[0].path.turning.size
    for trace, predicted in zip(traces, forecasts, strict=True):
        assert trace.before.shape == trace.after.shape == trace.signal.shape
        near = np.sqrt(np.mean((trace.signal - trace.after) ** 2))
        assert near < 0.2 * trace.signal.std()
        assert np.all(predicted.sd > 0.0)
    assert (traces[0].fluctuation is not None) == ("random_force" in candidates.sets[0])


def test_a_forecast_is_of_all_laws_each_as_probable_as_after_the_whole_record(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drawn: list[DrawnLaws] = []

    def kept(*given: Any) -> DrawnLaws:
        drawn.append(draw_laws(*given))
        return drawn[-1]

    monkeypatch.setattr(forecast, "draw_laws", kept)
    # damping and drag cannot be separated under as much noise
    candidates = alone(1e-4)
    assert candidates.forecasts
    (laws,) = drawn[0].records
    found = Counter(laws.fit.sets[k] for k in laws.set_index)
    probable = [k for k, p in enumerate(candidates.probabilities) if p > 0.05]
    assert len(probable) > 1
    for names, probability in ((candidates.sets[k], candidates.probabilities[k]) for k in probable):
        # of few draws, which are shared out evenly
        assert found[names] / found.total() == pytest.approx(probability, abs=0.1)


def test_what_is_left_is_one_verdict(candidates: Candidates) -> None:
    left, noise = candidates.left(), candidates.noise()
    assert set(left) == LEFT
    assert left["friction_could_shift_by"] >= 0.0
    assert set(noise) == {"model", "order", "sd", "correlation_length_s", "step", "filter"}
    assert candidates.noise_floor() == pytest.approx(candidates.tests.rms, rel=1e-2)
    if not candidates.tests.failed:
        assert candidates.explains


def test_what_is_reported_of_the_first_record_alone(candidates: Candidates) -> None:
    model, z = candidates.simulated()
    segment = model.segments[0]
    predicted = model.predict_at(z, 0, segment.time)
    assert predicted is not None
    assert np.std(segment.values - predicted.signal) < 0.3 * segment.values.std()
    between = candidates.between_records()
    assert (between is not None) == (records(candidates) > 1)


def test_contenders_predict_as_their_draws_say(candidates: Candidates) -> None:
    for i, names in enumerate(candidates.sets[:2]):
        found, mine = candidates.contender(names), candidates.mixture.candidate == i
        if np.count_nonzero(mine) < 100:
            assert i > 0
            continue
        assert found is not None
        mean, sd = candidates.mixture.friction[mine].mean(), candidates.mixture.friction[mine].std()
        assert abs(found.friction - mean) < 3.0 * sd
        assert set(found.model.effects) <= names
        assert (found.random_force > 0.0) == ("random_force" in names)


@pytest.mark.parametrize(
    ("means", "sd", "agree"),
    [
        ((1.0, 1.008, 0.999), 1e-4, True),
        ((1.0, 1.03, 0.97), 0.03, True),
        # the interval over both contains both, as it is as wide as they differ
        ((1.0, 1.3), 0.01, False),
        ((1.0, 1.3), 0.3, True),
        ((1.0, 1.001, math.nan), 0.01, False),
    ],
)
def test_candidates_agree_on_friction_each_by_itself(
    means: tuple[float, ...], sd: float, agree: bool, rng: np.random.Generator
) -> None:
    drawn = [(c, mean) for c, mean in enumerate(means) if not math.isnan(mean)]
    friction = np.concatenate([rng.normal(mean, sd, 500) for _, mean in drawn])
    none = np.zeros(friction.size)
    mixture = CandidateMixture(
        sets=tuple(frozenset({f"effect_{c}"}) for c in range(len(means))),
        probabilities=np.full(len(means), 1.0 / len(means)),
        candidate=np.repeat([c for c, _ in drawn], 500),
        friction=friction,
        random_force=none,
        scores=none[:, None],
    )
    assert mixture.same_friction(len(means)) == agree


def test_between_records_each_has_a_friction(joint: Candidates) -> None:
    between = joint.between_records()
    assert 0.0 < between["probability"] < 1.0
    for record in between["records"]:
        assert record["friction"]["mean"] == pytest.approx(0.07, abs=5.0 * record["friction"]["sd"])


def test_a_further_record_would_have_a_friction_of_its_own(joint: Candidates) -> None:
    every, spread = np.ones(DRAWS, np.bool_), np.full(DRAWS, 0.01)
    one, other = (drawn_contender(replace(joint.laws, spread=sd), every) for sd in (np.zeros(DRAWS), spread))
    assert one is not None
    assert other is not None
    rubs = one.model.index("friction")
    scale = one.model.coordinates[rubs].prior.scale
    added = np.sqrt(other.covariance[rubs, rubs] - one.covariance[rubs, rubs])
    assert added * scale == pytest.approx(0.01)


def test_a_force_of_several_frictions_is_a_candidate() -> None:
    """Its size is evidence that friction is hardly known, not against the force."""
    candidates = together(share=4.0)
    forced = ["random_force" in names for names in candidates.sets]
    assert candidates.probabilities[forced].sum() > 0.99
    assert np.median(candidates.mixture.random_force) > 2.0 * 0.07
    friction = candidates.mixture.friction
    assert abs(friction.mean() - 0.07) < 3.0 * friction.std()
    assert friction.std() > 0.01


EFFECTS = (
    frozenset[str](),
    frozenset({"presliding"}),
    frozenset({"presliding"}),
    frozenset({"viscous_damping"}),
)


def cells(*weights: float) -> Cells:
    """Two points, the second with a random force, and four sets of which two are the same effects."""
    without = np.array(weights).reshape(2, 4)
    noises = (frozenset(), frozenset({"timing_jitter"}))
    return Cells(np.array([without, 0.2 * without]), np.array([False, True]), EFFECTS, noises)


def test_cells_of_the_same_effects_are_one_candidate() -> None:
    found = cells(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
    sums = found.probabilities
    assert sums[frozenset({"presliding"})] == pytest.approx(5.0)
    assert sums[frozenset({"presliding", "random_force"})] == pytest.approx(13.0)
    assert sums[frozenset({"viscous_damping", "random_force", "timing_jitter"})] == pytest.approx(1.6)
    assert sum(sums.values()) == pytest.approx(found.weight.sum())
    sets = [frozenset({"presliding", "random_force"}), frozenset({"timing_jitter"})]
    places = found.places(sets)
    assert np.argwhere(places == 0).tolist() == [[0, 1, 1], [0, 1, 2]]
    assert np.argwhere(places == 1).tolist() == [[1, 0, 0]]
    assert np.count_nonzero(places == -1) == 16 - 3
