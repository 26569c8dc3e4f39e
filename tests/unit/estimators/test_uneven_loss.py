"""Amplitudes that fall faster while they are larger: how probable, and friction then."""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.decay.free_decay import FreeDecay, find_free_decay
from friction_bayes.estimators import batch, estimate
from friction_bayes.estimators.envelope.loss_of_amplitude import (
    UnevenLoss,
    _coefficients,
    _triangular,
    uneven_loss,
)
from friction_bayes.estimators.waveform import averaged
from friction_bayes.estimators.witness import Witness, answer_parts, not_negative

SYSTEM = fb.Oscillator(mass=2.0, stiffness=800.0)
SURE = 0.95


def decay(
    friction: float,
    seed: int = 7,
    quantity: str = "displacement",
    duration: float = 8.0,
    sampling_rate: float = 100.0,
    noise_sd: float | None = None,
    **effects: float,
) -> Any:
    usual = {"displacement": 4e-5, "velocity": 8e-4, "acceleration": 1.6e-2}[quantity]
    return fb.simulate(
        SYSTEM,
        friction=friction,
        initial_displacement=0.0203,
        duration=duration,
        sampling_rate=sampling_rate,
        noise_sd=usual if noise_sd is None else noise_sd,
        seed=seed,
        quantity=quantity,
        effects={name.replace("__", "."): value for name, value in effects.items()},
    )


@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
@pytest.mark.parametrize("friction", [0.02, 0.2])
@pytest.mark.parametrize("zeta", [0.002, 0.01])
def test_damping_is_seen_and_friction_with_it_is_right(friction: float, zeta: float, quantity: str) -> None:
    record = decay(friction, quantity=quantity, viscous_damping__damping_ratio=zeta)
    found = uneven_loss(find_free_decay(record, SYSTEM))
    assert found is not None
    assert found.probability > SURE
    k = SYSTEM.force_factor(find_free_decay(record, SYSTEM).quantity)
    assert k * found.coefficient.mean() == pytest.approx(friction, abs=4.0 * k * found.coefficient.std())


@pytest.mark.parametrize(
    ("quantity", "zeta", "share", "half_cycles"),
    [
        ("displacement", 0.02, 0.02, 8),
        ("displacement", 0.05, 0.0035, 18),
        ("displacement", 0.05, 0.005, 8),
        ("displacement", 0.1, 0.02, 18),
        ("velocity", 0.05, 0.005, 12),
        ("acceleration", 0.02, 0.02, 8),
        ("acceleration", 0.02, 0.001, 40),
        ("acceleration", 0.05, 0.05, 18),
    ],
)
def test_friction_with_damping_is_right_to_the_end_of_the_record(
    quantity: str, zeta: float, share: float, half_cycles: int
) -> None:
    """A sampled half cycle of a damped decay is no pure cosine, a whole number of samples or centred on them.

    ``share`` is friction over stiffness and amplitude; nearly without noise what is left is systematic.
    """
    amplitude, true = 0.02, share * 800.0 * 0.02
    record = fb.simulate(
        SYSTEM,
        friction=true,
        initial_displacement=amplitude,
        duration=half_cycles * np.pi / 20.0,
        sampling_rate=600.0 / np.pi,
        noise_sd=1e-5 * amplitude * {"displacement": 1.0, "velocity": 20.0, "acceleration": 400.0}[quantity],
        seed=1,
        quantity=quantity,
        effects={"viscous_damping.damping_ratio": zeta},
    )
    located = find_free_decay(record, SYSTEM)
    found = uneven_loss(located)
    assert found is not None
    k = SYSTEM.force_factor(located.quantity)
    assert k * found.coefficient.mean() == pytest.approx(true, rel=0.03)
    assert k * found.coefficient.ppf(0.02) < true < k * found.coefficient.ppf(0.98)


@pytest.mark.parametrize("zeta", [0.05, 0.1])
def test_a_mass_at_rest_has_no_half_cycle(zeta: float) -> None:
    """Long at rest on record, without noise: one half cycle too many is located, of no amplitude."""
    system, friction = fb.Oscillator(mass=10.0, stiffness=1000.0), 0.07
    record = fb.simulate(
        system,
        friction=friction,
        initial_displacement=0.007,
        duration=18.85,
        sampling_rate=1000.0,
        seed=1,
        effects={"viscous_damping.damping_ratio": zeta},
    )
    found = uneven_loss(find_free_decay(record, system))
    assert found is not None
    low, high = system.stiffness * found.coefficient.ppf([0.05, 0.95])
    assert low < friction < high
    assert high - low < 0.03 * friction


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
@pytest.mark.parametrize("zeta", [0.17, 0.2])
@pytest.mark.parametrize("duration", [0.8, 1.2])
def test_strong_damping_of_a_few_half_cycles_is_seen(quantity: str, zeta: float, duration: float) -> None:
    """Three to four e-folds, after which friction stops what is left; dry friction alone takes a fiftieth."""
    record = fb.simulate(
        SYSTEM,
        friction=0.08,
        initial_displacement=0.02,
        duration=duration,
        sampling_rate=200.0,
        noise_sd=6e-5 * {"displacement": 1.0, "acceleration": 400.0}[quantity],
        seed=1,
        quantity=quantity,
        effects={"viscous_damping.damping_ratio": zeta},
    )
    found = uneven_loss(find_free_decay(record, SYSTEM))
    assert found is not None
    assert found.probability > SURE


def test_drag_that_leaves_less_than_no_friction_to_damping_is_seen() -> None:
    """Its exponent lies beyond the one with which damping takes all that is lost."""
    record = decay(1e-9, quadratic_drag__drag_coefficient=8.0)
    located = find_free_decay(record, SYSTEM)
    found = uneven_loss(located)
    assert found is not None
    assert found.coefficient.cdf(0.0) > 0.99
    assert found.probability > SURE


@pytest.mark.parametrize(("compressed", "faster"), [(0.03, False), (-0.03, True)])
def test_a_sensor_that_bends_makes_the_loss_uneven(compressed: float, faster: bool) -> None:
    """Its slope at rest is one; friction of all swings alike is as wrong as large ones are shown."""
    # of 480 samples: the search for what colours their noise takes four times as long with 800
    record = decay(0.2, duration=6.0, sampling_rate=80.0)
    bent = record.copy(data=record.values * (1.0 - compressed * (record.values / 0.0203) ** 2))
    uneven = uneven_loss(find_free_decay(bent, SYSTEM))
    assert uneven is not None
    assert uneven.probability > SURE
    assert uneven.faster is faster
    found, alone = fb.estimate(bent, SYSTEM), without_force(bent).friction
    assert not alone.ppf(0.05) < 0.2 < alone.ppf(0.95)
    assert found.friction.ppf(0.05) < 0.2 < found.friction.ppf(0.95)


def without_force(record: Any) -> fb.Estimate:
    """Under dry friction alone."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.RecordWarning)
        return fb.estimate(record, SYSTEM, random_force="none")


def friction_said(note: str) -> list[tuple[float, float]]:
    """The 90 % intervals of a note."""
    return [(float(low), float(high)) for low, high in re.findall(r"(\S+) \.\. (\S+) N \(90 %\)", note)]


def test_friction_with_damping_is_said_before_the_number() -> None:
    with pytest.warns(fb.RecordWarning, match="falls faster while it is larger") as said:
        found = fb.estimate(decay(0.02, noise_sd=4e-6, viscous_damping__damping_ratio=0.002), SYSTEM)
    assert found.notes[0] == str(said[0].message).replace("close_loop", "close-loop")
    (damped,) = friction_said(found.notes[0])
    assert 0.9 * 0.02 < damped[0] < 0.02 < damped[1] < 1.1 * 0.02
    assert damped == pytest.approx(found.friction.interval(0.9), rel=0.01)
    assert "viscous damping (" in found.notes[0]
    reported = found.to_dict()["uneven_loss"]
    assert reported["losses"]["viscous_damping"] > 0.5
    assert reported["faster"] is True
    assert reported["probability"] > 0.95
    assert reported["friction"]["interval90"] == pytest.approx(damped, rel=0.01)
    with pytest.warns(fb.RecordWarning, match="there need be no dry friction"):
        fb.estimate(decay(1e-9, viscous_damping__damping_ratio=0.01), SYSTEM)


def test_slight_damping_is_said_and_in_the_interval() -> None:
    """It takes 7 % of the loss: dry friction alone would be that much too large, with an sd of .4 %."""
    slight = fb.simulate(
        SYSTEM,
        friction=0.07,
        initial_displacement=0.0147,
        duration=8.0,
        sampling_rate=200.0,
        noise_sd=2e-4,
        seed=3,
        effects={"viscous_damping.damping_ratio": 0.0004},
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error", fb.RecordWarning)
        found = fb.estimate(slight, SYSTEM)
    assert 0.2 < found.fit.uneven_loss.probability < SURE
    assert "may fall faster while it is larger" in found.notes[0]
    (damped,) = friction_said(found.notes[0])
    assert damped[0] < 0.07 < damped[1]
    assert without_force(slight).friction.ppf(0.05) > 0.074
    assert found.friction.ppf(0.05) < 0.07 < found.friction.ppf(0.95)


def accelerometer(damping_ratio: float, seed: int) -> fb.Estimate:
    setting = {"sampling_rate": 200.0, "noise_sd": 0.06, "viscous_damping__damping_ratio": damping_ratio}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.RecordWarning)
        return fb.estimate(decay(0.07, seed, "acceleration", **setting), SYSTEM)


def width(distribution: Any) -> float:
    return float(distribution.ppf(0.95) - distribution.ppf(0.05))


def test_an_accelerometer_weighs_damping_by_what_its_jumps_say() -> None:
    """They show friction itself: slight damping is in the interval, which without any is hardly wider."""
    covered = 0
    for seed in range(4):
        damped, plain = accelerometer(0.0004, seed), accelerometer(0.0, seed)
        covered += damped.friction.ppf(0.05) < 0.07 < damped.friction.ppf(0.95)
        assert damped.fit.uneven_loss.probability > 0.5
        assert damped.fit.uneven_loss.faster
        assert plain.fit.uneven_loss.probability < 0.1
        assert width(plain.friction) < 1.1 * width(plain.friction_as_declared)
    assert covered >= 3


def test_regressions_are_those_of_numpy(rng: np.random.Generator) -> None:
    """Columns in units far apart, of which one is the sum of two others but for little."""
    rows = rng.standard_normal((26, 100, 4)) * [1.0, 1e-6, 1e3, 1.0]
    rows[:, :, 2] = 1e3 * rows[:, :, 0] + 1e9 * rows[:, :, 1] + 1e-3 * rows[:, :, 2]
    upper = _triangular(rows)
    np.testing.assert_allclose(np.abs(np.linalg.qr(rows, mode="r")), np.abs(upper), rtol=1e-9)
    location, scale, log_determinant = _coefficients(upper)
    for k, own in enumerate(rows):
        design, response = own[:, :-1], own[:, -1]
        # each column in its own size, or the inverse has no digits
        size = np.linalg.norm(design, axis=0)
        expected = np.linalg.lstsq(design / size, response)[0] / size
        np.testing.assert_allclose(location[k], expected, rtol=1e-8)
        gram = (design / size).T @ (design / size)
        np.testing.assert_allclose(scale[k], np.sqrt(np.diag(np.linalg.inv(gram))) / size, rtol=1e-5)
        half = 0.5 * np.linalg.slogdet(gram)[1] + np.log(size).sum()
        assert log_determinant[k] == pytest.approx(half, abs=1e-5)
    rows[:, :, 1] = 2.0 * rows[:, :, 0]
    assert np.all(np.isinf(_coefficients(_triangular(rows))[2]))


def test_it_is_computed_once_for_a_record(monkeypatch: pytest.MonkeyPatch) -> None:
    """By ``estimate``, and in a batch too short for a glance at its amplitudes."""
    computed = []

    def counted(decay: FreeDecay) -> UnevenLoss | None:
        computed.append(decay.name)
        return uneven_loss(decay)

    for module in (averaged, batch, estimate):
        monkeypatch.setattr(module, "uneven_loss", counted)
    fb.estimate(decay(0.4), SYSTEM, method="envelope")
    fb.estimate(decay(0.4), SYSTEM)
    assert len(computed) == 2
    computed.clear()
    records = [decay(0.8, seed=seed).values for seed in range(4)]
    many = fb.estimate_batch(np.array(records), SYSTEM, sampling_rate=100.0, quantity="displacement")
    assert int((many["warnings"] != 0).sum()) == 0
    assert sorted(computed) == [f"record {row}" for row in range(4)]


def test_a_method_without_a_witness_says_that_it_reports_dry_friction_alone() -> None:
    with pytest.warns(fb.RecordWarning, match=r"alone it would have to be .* and this is reported"):
        fb.estimate(decay(0.02, viscous_damping__damping_ratio=0.002), SYSTEM, method="envelope")


@pytest.mark.parametrize(
    ("zeta", "quantity"),
    [(0.02, "displacement"), (0.02, "acceleration"), (0.05, "displacement"), (0.1, "displacement")],
)
def test_friction_with_damping_is_right_where_dry_friction_alone_is_far_off(
    zeta: float, quantity: str
) -> None:
    """Six to thirty half cycles; dry friction alone would have to be at least 1.2 times what there is."""
    true = 0.005 * 800.0 * 0.0203
    record = decay(true, quantity=quantity, viscous_damping__damping_ratio=zeta)
    with pytest.warns(fb.RecordWarning, match="viscous damping"):
        found = fb.estimate(record, SYSTEM)
    low, high = found.friction.interval(0.98)
    assert low < true < high
    assert high - low < 0.25 * true
    assert without_force(record).friction.ppf(0.05) > 1.2 * true


def test_a_witness_below_zero_draws_the_interval_to_zero() -> None:
    """As of a decay under drag alone, in which friction with damping would be negative."""
    one = np.ones(1)
    posterior, below = (Mixture.of_normals(one, place * one, 0.1 * one) for place in (2.0, -1.0))
    answer = not_negative(answer_parts(posterior, Witness(below, agrees=False, bounds=False), None))
    assert 0.0 < answer.ppf(0.05) < 0.01
    assert answer.ppf(0.95) == pytest.approx(2.0 + 0.1 * 1.2816, abs=1e-3)


def test_friction_with_damping_counts_by_its_probability() -> None:
    """What is improbable is omitted, and what the posterior has already does not count again."""
    one = np.ones(1)
    alone, damped = (Mixture.of_normals(one, place * one, 0.01 * one) for place in (2.0, 1.0))
    agreeing = Witness(alone, agrees=True, bounds=False)
    for probability in (0.1, 0.4, 0.8):
        answer = not_negative(answer_parts(alone, agreeing, UnevenLoss(probability, True, damped)))
        assert answer.cdf(1.5) == pytest.approx(probability)
        assert answer.cdf(1.0) == pytest.approx(0.5 * probability)
        counted = UnevenLoss(probability, True, damped, {"viscous_damping": 1.0})
        assert not_negative(answer_parts(alone, agreeing, counted)) is alone
    assert not_negative(answer_parts(alone, agreeing, UnevenLoss(0.005, True, damped))) is alone


def test_damping_that_is_neither_seen_nor_excluded_is_in_the_interval(seed: int) -> None:
    """Of records with a probability of damping between .3 and .95: dry friction alone contains hardly any.

    Fewer than four of six come once in five hundred where the share is .95.
    """
    rng = np.random.default_rng(seed)
    inside, alone, true = [], [], 0.2
    for _ in range(120):
        if len(inside) == 6:
            break
        record = fb.simulate(
            SYSTEM,
            friction=true,
            initial_displacement=0.0203,
            duration=3.0,
            sampling_rate=60.0,
            noise_sd=2e-4,
            seed=int(rng.integers(2**31)),
            effects={"viscous_damping.damping_ratio": 0.002},
        )
        # one in six is estimated, which takes fifty times as long
        by_amplitudes = uneven_loss(find_free_decay(record, SYSTEM))
        assert by_amplitudes is not None
        if not 0.3 < by_amplitudes.probability < SURE:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", fb.RecordWarning)
            found = fb.estimate(record, SYSTEM)
        if not 0.3 < found.fit.uneven_loss.probability < SURE:
            continue
        for contained, friction in ((inside, found.friction), (alone, without_force(record).friction)):
            contained.append(friction.ppf(0.05) < true < friction.ppf(0.95))
        said = ("averaged over these", "from the one towards the other")
        assert any(each in note for each in said for note in found.notes)
    assert len(inside) == 6
    assert sum(inside) >= 4
    assert sum(alone) <= 2


def test_neither_dry_friction_nor_a_random_force_is_taken_for_it(seed: int) -> None:
    """A probability of 0.95 means one false in twenty where half of all have damping; none has here.

    With prior odds of one to four a Bayes factor of 76 is needed, which chance exceeds in at most 1.3 %, and
    did in one of 500: three or more of 40 come with a probability of 1.6 % at most, of 1e-4 at that rate.
    """
    rng = np.random.default_rng(seed)
    false = 0
    for _ in range(40):
        forces = {"random_force.sd": 0.1 * rng.uniform(0.5, 4.0), "random_force.correlation_time": 0.2}
        record = fb.simulate(
            SYSTEM,
            friction=rng.uniform(0.2, 0.5),
            initial_displacement=0.0203,
            duration=3.0,
            sampling_rate=200.0,
            noise_sd=1e-5 * 10.0 ** rng.uniform(0.0, 1.5),
            seed=int(rng.integers(2**31)),
            effects=forces if rng.random() < 0.5 else {},
        )
        found = uneven_loss(find_free_decay(record, SYSTEM))
        false += found is not None and found.probability > SURE
    assert false < 3


def test_what_damping_too_slight_to_see_would_mean_is_said() -> None:
    """Friction alone is .7 % high, as the damping takes 1.2 % of the loss, and seems known to .1 %."""
    record = fb.simulate(
        fb.Oscillator(mass=10.0, stiffness=1000.0),
        friction=0.07,
        initial_displacement=0.0147,
        duration=15.0,
        sampling_rate=100.0,
        noise_sd=3e-5,
        seed=3,
        effects={"viscous_damping.damping_ratio": 3e-5},
    )
    found = fb.estimate(record, fb.Oscillator(mass=10.0, stiffness=1000.0))
    low, high = found.friction.interval(0.9)
    assert not low < 0.07 < high
    (note,) = (note for note in found.notes if "should more than dry friction act" in note)
    low, high = (float(end) for end in re.findall(r"is ([\d.]+) \.\. ([\d.]+) N", note)[0])
    assert low < 0.07 < high


def test_what_friction_then_is_has_the_doubt_of_mass_and_stiffness() -> None:
    """Where these contradict the frequency, in the note as in the result's own fields."""
    declared = fb.Oscillator(mass=2.0, stiffness=880.0)
    with pytest.warns(fb.RecordWarning, match="standard deviations apart"):
        found = fb.estimate(decay(0.3), declared)
    (note,) = (note for note in found.notes if "should more than dry friction act" in note)
    said = [float(end) for end in re.findall(r"is ([\d.]+) \.\. ([\d.]+) N", note)[0]]
    assert said == pytest.approx(found.to_dict()["uneven_loss"]["friction"]["interval90"], rel=2e-3)
    assert said[1] > 1.08 * said[0]


@pytest.mark.parametrize("scale", [1e-9, 1e-7, 1e5])
def test_it_is_known_in_any_unit(scale: float) -> None:
    """A column in the unit of the signal is no less known for being small."""
    record = decay(0.2)
    found, scaled = (uneven_loss(find_free_decay(each, SYSTEM)) for each in (record, scale * record))
    assert found is not None
    assert scaled is not None
    assert scaled.probability == pytest.approx(found.probability, rel=1e-6)
