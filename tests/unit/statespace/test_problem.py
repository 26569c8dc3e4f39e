"""Several records under one law: own columns integrated out against all of them at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from friction_bayes.statespace.force_prior import GridPoint
from friction_bayes.statespace.kalman import Clock, Whitened, sensor_row, whiten
from friction_bayes.statespace.positive_orthant import cut_moments
from friction_bayes.statespace.problem import Member, Problem, Spread
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.smoother import SmoothedMotion
from friction_bayes.statespace.subset_evidence import (
    SetEvidences,
    bound_sets,
    evaluate_bounded,
    set_marginals,
    set_posterior,
)

OWN = np.array([True, True, False, False, False, True])
POSITIVE = np.array([False, False, True, True, False, False])
SETS = np.array(
    [
        [True, True, True, False, False, False],
        [True, True, True, True, False, False],
        [True, True, True, False, True, True],
        [True, True, True, True, True, True],
    ]
)
LOG_PRIOR = np.log([0.2, 0.2, 0.3, 0.3])
EVERY = np.ones(4, bool)
FRICTION = np.full(4, 2)
NONE = Spread(columns=FRICTION, sd=np.zeros(1), log_prior=np.zeros(1))
SOME = Spread(columns=FRICTION, sd=np.array([0.0, 0.03, 0.3]), log_prior=np.log([0.5, 0.3, 0.2]))
RATIO, TAU = 0.7, 1.3


def point(found: SetEvidences) -> GridPoint:
    return GridPoint(ratio=RATIO, tau=TAU, log_volume=0.0, found=found)


def record(rng: np.random.Generator, samples: int, noise: float, friction: float) -> LawRegression:
    """A record of six columns that look like nothing in particular, and three coefficients."""
    columns = rng.standard_normal((samples, 6)) + np.linspace(0.0, 1.0, samples)[:, None]
    scale = np.array([5.0, 5.0, 2.0, 0.5, 0.5, 1.0])
    law = np.array([1.0, -2.0, friction, 0.01, 0.01, 0.02])
    still = np.zeros((samples, 3))
    return LawRegression(
        clock=Clock.of(0.2 * np.arange(samples)),
        row=sensor_row(0),
        names=tuple("abcdef"),
        columns=columns,
        states=np.zeros((samples, 2, 6)),
        known_states=np.zeros((samples, 2)),
        target=columns @ law + noise * rng.standard_normal(samples),
        scale=scale,
        positive=POSITIVE,
        sets=SETS,
        log_prior=LOG_PRIOR,
        stiffness=4,
        motion=SmoothedMotion(
            states=still, covariance=np.zeros((samples, 3, 3)), noise=noise, force_sd=0.1, tau=1.0
        ),
    )


@pytest.fixture
def members(rng: np.random.Generator) -> tuple[Member, ...]:
    sizes = ((60, 0.1, 1.0), (80, 0.2, 1.1), (50, 0.05, 0.9))
    noises = [noise / 0.1 for _, noise, _ in sizes]
    return tuple(
        Member(regression=record(rng, *size), noise=noise, force=0.5 * noise)
        for size, noise in zip(sizes, noises, strict=True)
    )


def dense(members: tuple[Member, ...], spread: Spread) -> tuple[Whitened, np.ndarray, np.ndarray]:
    """Sums of all columns at once: own ones of each record, deviations of unit prior sd, shared ones.

    With them the sets, and the shared columns.
    """
    r, own, shared = len(members), np.flatnonzero(OWN), np.flatnonzero(~OWN)
    size = r * own.size + r + shared.size
    gram, log_determinant, used = np.zeros((size + 1, size + 1)), 0.0, 0
    deviation = spread.sd[spread.sd > 0.0]
    for i, member in enumerate(members):
        ratio = RATIO * member.force / member.noise
        regression = member.regression
        block = np.column_stack([regression.columns * regression.scale, regression.target])
        whitened = whiten(block, regression.clock, regression.row, ratio, TAU)
        place = np.concatenate([i * own.size + np.arange(own.size), [r * own.size + i]])
        place = np.concatenate([place, r * own.size + r + np.arange(shared.size), [size]])
        take = np.concatenate([own, spread.columns[:1], shared, [6]])
        weight = np.ones(take.size)
        weight[own.size] = deviation[0] if deviation.size else 0.0
        part = whitened.gram[np.ix_(take, take)] * np.outer(weight, weight) / member.noise**2
        gram[np.ix_(place, place)] += part
        log_determinant += whitened.log_determinant + 2.0 * whitened.used * np.log(member.noise)
        used += whitened.used
    sets = np.hstack(
        [np.tile(SETS[:, own], r), np.full((len(SETS), r), bool(deviation.size)), SETS[:, shared]]
    )
    return Whitened(gram, log_determinant, used), sets, r * own.size + r + np.arange(shared.size)


@pytest.mark.parametrize("sd", [0.0, 0.03, 0.3])
def test_own_columns_integrated_out_are_all_columns_at_once(members, sd: float) -> None:
    spread = Spread(columns=FRICTION, sd=np.array([sd]), log_prior=np.zeros(1))
    joint = Problem(members, OWN, spread)
    found = joint.evaluate(RATIO, TAU)
    whitened, sets, together = dense(members, spread)
    positive = np.zeros(sets.shape[1], bool)
    positive[together] = POSITIVE[~OWN]
    evaluated = whitened, np.zeros(sets.shape[1]), positive, sets
    expected = evaluate_bounded(*evaluated, bound_sets(*evaluated, LOG_PRIOR, lam=found.full_noise2))
    # sets far behind are not evaluated to the end, and own columns are evaluated apart
    near = expected.log_weight > expected.log_weight.max() - 12.0
    assert near.sum() >= 2
    np.testing.assert_allclose(found.log_weight[near], expected.log_weight[near], rtol=1e-7)
    np.testing.assert_allclose(found.noise2, expected.noise2, rtol=1e-7)
    for k in np.flatnonzero(near):
        mine = joint.marginals(point(found), k)
        noise2 = float(expected.noise2[k])
        posterior = set_posterior(whitened.gram, evaluated[1], sets[k], expected.full_noise2, noise2)
        theirs = set_marginals(*posterior, sets[k], positive)
        for my, their in zip(mine, theirs, strict=True):
            np.testing.assert_allclose(my[~OWN], their[together], rtol=1e-5)


def test_the_noise_of_all_columns_counts_each_once(members) -> None:
    joint = Problem(members, OWN, NONE)
    found = joint.evaluate(RATIO, TAU)
    gram = dense(members, NONE)[0].gram
    used = np.flatnonzero(np.diag(gram)[:-1])
    law = np.linalg.solve(gram[np.ix_(used, used)], gram[used, -1])
    rest = gram[-1, -1] - law @ gram[used, -1]
    samples = sum(member.regression.target.size for member in members)
    assert found.full_noise2 == pytest.approx(rest / (samples - used.size), rel=1e-6)


def test_one_record_is_what_it_is_alone(members) -> None:
    alone = members[0].regression
    problem = Problem([Member(regression=alone)], OWN, NONE)
    joint, found = problem.evaluate(RATIO, TAU), Problem.of(alone).evaluate(RATIO, TAU)
    np.testing.assert_allclose(joint.log_weight, found.log_weight, rtol=1e-9)
    for k in range(len(SETS)):
        together, by_itself = problem.marginals(point(joint), k), Problem.of(alone).marginals(point(found), k)
        np.testing.assert_allclose(together[0][~OWN], by_itself[0][~OWN], rtol=1e-6)


def test_without_the_best_set_the_others_are_what_they_are_without_its_prior(members) -> None:
    problem = Problem(members, OWN, SOME)
    before = problem.evaluate(RATIO, TAU)
    # a set that was far behind may have been bounded alone
    best = np.arange(len(before.log_weight)) == before.log_weight.argmax()
    without = problem.without(best)
    for tau in (TAU, 2.0 * TAU):
        found = without.evaluate(RATIO, tau)
        anew = Problem(members, OWN, SOME).evaluate(RATIO, tau)
        assert np.isneginf(found.log_weight[best]).all()
        assert found.log_weight.max() == pytest.approx(anew.log_weight[~best].max(), rel=1e-9)
        # the problem that it was made from has all sets, at places that it has not been at too
        np.testing.assert_allclose(problem.evaluate(RATIO, tau).log_weight, anew.log_weight, rtol=1e-12)


def test_without_sets_one_record_is_evaluated_on_the_others(members) -> None:
    alone = members[0].regression
    problem = Problem.of(alone)
    left_out = np.zeros(len(SETS), bool)
    for best in np.argsort(-problem.evaluate(RATIO, TAU).log_weight)[:-1]:
        left_out[best] = True
        found = problem.without(left_out).evaluate(RATIO, TAU).log_weight
        assert np.array_equal(np.isneginf(found), left_out)
        only = replace(alone, sets=SETS[~left_out], log_prior=LOG_PRIOR[~left_out], near=alone.reference)
        assert found.max() == pytest.approx(Problem.of(only).evaluate(RATIO, TAU).log_weight.max(), rel=1e-9)


def test_mean_coefficients_are_those_of_the_marginals_cut_at_zero(members) -> None:
    problem = Problem(members, OWN, SOME)
    found = point(problem.evaluate(RATIO, TAU))
    assert POSITIVE[~OWN].any()
    for row in range(len(problem.sets)):
        location, scale2 = problem.marginals(found, row)
        cut = [cut_moments(*pair)[1] for pair in zip(location, scale2, strict=True)]
        expected = np.where(problem.sets[row], np.where(POSITIVE, cut, location), 0.0)
        np.testing.assert_allclose(problem.mean(found, row), expected, rtol=1e-9)


def test_copies_of_a_record_say_the_same_and_are_surer(members) -> None:
    alone = members[0].regression
    problems = [Problem([Member(regression=alone)] * copies, OWN, NONE) for copies in (1, 4)]
    one, four = (problem.marginals(point(problem.evaluate(RATIO, TAU)), 0) for problem in problems)
    np.testing.assert_allclose(four[0][2], one[0][2], rtol=1e-3)
    assert four[1][2] == pytest.approx(one[1][2] / 4.0, rel=0.05)


def test_records_laws_are_the_coefficients_of_all_columns_at_once(members) -> None:
    spread = Spread(columns=FRICTION, sd=np.array([0.03]), log_prior=np.zeros(1))
    joint = Problem(members, OWN, spread)
    found = joint.evaluate(RATIO, TAU)
    point = GridPoint(ratio=RATIO, tau=TAU, log_volume=0.0, found=found)
    row = 3
    said = joint.conditional(point, row)
    laws = said.laws(said.mean[None])[0]
    whitened, sets, together = dense(members, spread)
    inside = np.flatnonzero(sets[row])
    gram = whitened.gram[np.ix_(inside, inside)] + found.full_noise2 * np.eye(inside.size)
    solved = np.zeros(sets.shape[1])
    solved[inside] = np.linalg.solve(gram, whitened.gram[inside, -1])
    for i in range(3):
        np.testing.assert_allclose(laws[i, OWN], (solved[3 * i : 3 * i + 3] * joint.scale[OWN]), rtol=1e-5)
        friction = (solved[together[0]] + 0.03 * solved[9 + i]) * joint.scale[2]
        assert laws[i, 2] == pytest.approx(friction, rel=1e-6)
    drawn = said.laws(np.tile(said.mean, (4000, 1)), np.random.default_rng(1))
    np.testing.assert_allclose(drawn.mean(axis=0), laws, atol=5.0 * drawn.std(axis=0).max() / 60.0)


def test_a_spread_that_is_there_is_found(members) -> None:
    joint = Problem(members, OWN, SOME)
    found = joint.evaluate(RATIO, TAU)
    by_spread = np.logaddexp.reduce(found.log_weight.reshape(3, -1), axis=1)
    assert by_spread[1:].max() > by_spread[0] + 1.0
    assert joint.sets.shape == (12, 6)


def test_a_set_without_the_column_does_not_deviate(members) -> None:
    spread = Spread(columns=np.array([-1, 2, 2, 2]), sd=SOME.sd, log_prior=SOME.log_prior)
    joint = Problem(members, OWN, spread)
    assert joint.spread_number[joint.number == 0].tolist() == [0]
    assert joint.spread_number[joint.number == 1].tolist() == [0, 1, 2]
    assert np.isfinite(joint.evaluate(RATIO, TAU).log_weight).all()


def test_a_deviation_is_in_the_column_of_the_set(members) -> None:
    spread = Spread(columns=np.array([2, 3, 2, 3]), sd=np.array([0.3]), log_prior=np.zeros(1))
    joint = Problem(members, OWN, spread)
    point = GridPoint(ratio=RATIO, tau=TAU, log_volume=0.0, found=joint.evaluate(RATIO, TAU))
    for row, column in enumerate(spread.columns):
        said = joint.conditional(point, row)
        laws = said.laws(said.mean[None])[0]
        differs = np.ptp(laws[:, ~OWN], axis=0) > 0.0
        assert np.flatnonzero(~OWN)[differs].tolist() == [column]


def test_sets_that_are_kept_have_their_weight_among_all(members) -> None:
    every, few = (
        Problem(members, OWN, SOME),
        Problem(members, OWN, SOME, EVERY & [True, False, True, True]),
    )
    assert set(few.number) == {0, 2, 3}
    found, among = few.evaluate(RATIO, TAU), every.evaluate(RATIO, TAU)
    near = found.log_weight > among.log_weight.max() - 12.0
    assert near.any()
    rows = np.flatnonzero(every.number != 1)
    np.testing.assert_allclose(found.log_weight[near], among.log_weight[rows][near], rtol=1e-12)
