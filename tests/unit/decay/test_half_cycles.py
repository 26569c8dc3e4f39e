"""Half cycles and the paper's friction samples against the exact Coulomb decay and a pendulum."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.core.system import Oscillator, Pendulum
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.friction_samples import friction_samples, peak_amplitudes
from friction_bayes.decay.half_cycles import half_cycles

NAMES = ("displacement", "velocity", "acceleration")
W = 2 * np.pi * 2.9


def coulomb(order: int, t: np.ndarray, *, w: float, phase: float, a: float, u: float, c: float) -> np.ndarray:
    theta = w * t + phase
    n = np.floor(theta / np.pi)
    signal = (a - (2 * n + 1) * u) * np.cos(theta + order * np.pi / 2) + c
    return signal + u * (-1.0) ** n if order == 0 else signal


def decay_of(
    values: np.ndarray, step: float, *, order: int = 0, w: float = W, phase: float, **given
) -> FreeDecay:
    quantity = QUANTITIES[NAMES[order]]
    return FreeDecay(
        name="test record",
        values=values,
        start_time=given.pop("start_time", 0.0),
        step=step,
        quantity=given.pop("quantity", quantity),
        unit=given.pop("unit", quantity.unit),
        system=given.pop("system", Oscillator(mass=2.0, stiffness=2.0 * w**2)),
        frequency=1.01 * w,
        phase=phase % (2 * np.pi),
        rest_position=0.0,
        stops=False,
    )


def exact(data, order: int, *, w: float, phase: float, a: float, u: float, c: float, start: float = 0.0):
    j = data["turning_point"].values
    amplitude = a - (2 * j - order) * u
    return amplitude, c + (-1.0) ** j * amplitude, start + (j * np.pi - order * np.pi / 2 - phase) / w


# never exactly at the jump of an acceleration, where one sample belongs to either side
@pytest.mark.parametrize("phase", [0.05, 1.0, 4.5])
@pytest.mark.parametrize("step", [0.001, 0.01, 0.1])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_exact_without_noise(order: int, step: float, phase: float) -> None:
    truth = {"w": W, "phase": phase, "a": 240.0, "u": 1.0, "c": 37.0}
    t = np.arange(0.0, 18.0, step)
    decay = decay_of(coulomb(order, t, **truth), step, order=order, phase=phase + 0.1, start_time=3.0)
    data = half_cycles(decay)
    amplitude, value, time = exact(data, order, start=3.0, **truth)
    np.testing.assert_allclose(data["amplitude"], amplitude, atol=1e-7)
    np.testing.assert_allclose(data["value"], value, atol=1e-7)
    np.testing.assert_allclose(data["time"], time, atol=1e-8)
    np.testing.assert_allclose(data["drop"], 2.0, atol=1e-7)
    np.testing.assert_allclose(data["half_period"], np.pi / W, rtol=1e-6)
    np.testing.assert_array_equal(data["direction"], np.sign(np.diff(data["value"])))
    interval = data.attrs["half_cycles_per_interval"]
    assert interval == (5 if step == 0.1 else 1)
    # the centre of a half cycle of displacement lies u to the side it comes from
    side = (-1.0) ** data["turning_point"].values[:-1]
    np.testing.assert_allclose(data["centre"], 37.0 + side * interval * 1.0, atol=1e-7)
    assert data.attrs["rest_position"] == pytest.approx(37.0, abs=1e-7)
    whole = int((t[-1] * W + phase) / np.pi) - int(np.ceil(phase / np.pi))
    assert data.sizes["turning_point"] >= (whole - 2 if interval == 1 else whole // interval - 1)


@pytest.mark.parametrize("step", [0.001, 0.01, 0.1])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_errors_are_of_the_stated_size_at_8_db(rng: np.random.Generator, order: int, step: float) -> None:
    # mean square of the errors over their stated variance, about 110 (22) of them twenty times:
    # its sd is sqrt(2/m), and 5 sd give a false alarm in 2e6 (plus 5 % for the variation over windows)
    truth = {"w": W, "phase": 2.0, "a": 240.0, "u": 1.0, "c": 0.0}
    t = np.arange(0.0, 18.0, step)
    signal = coulomb(order, t, **truth)
    sd = signal.std() / 10 ** (8 / 20)
    total, count, drops = 0.0, 0, []
    for _ in range(20):
        decay = decay_of(signal + rng.normal(0.0, sd, t.size), step, order=order, phase=2.2)
        data = half_cycles(decay)
        _, value, _ = exact(data, order, **truth)
        error = data["value"].values - value
        if step == 0.001:
            assert data.attrs["noise_sd"] == pytest.approx(sd, rel=0.05)
        total += np.sum(error**2) / (data.attrs["value_sd"] ** 2)
        count += error.size
        drops.append(data["drop"].values.mean())
    assert abs(total / count - 1.0) < 5 * np.sqrt(2.0 / count) + (0.25 if step == 0.1 else 0.05)
    assert abs(np.mean(drops) - 2.0) < 5 * np.std(drops, ddof=1) / np.sqrt(20)


def pendulum(w0: float, d: float, start: float, t: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Angle, velocity, acceleration of ``theta'' = -w0^2 (sin theta + d sign theta')``; turning points."""
    signals = [np.empty_like(t) for _ in range(3)]
    x, begin, sign, turns = start, 0.0, -1.0, [start]
    while begin < t[-1]:

        def motion(_: float, y: np.ndarray, sign: float = sign) -> list[float]:
            return [y[1], -(w0**2) * (np.sin(y[0]) + d * sign)]

        def turned(s: float, y: np.ndarray, begin: float = begin, sign: float = sign) -> float:
            return y[1] if s > begin + 0.5 / w0 else sign

        turned.terminal = True
        span = (begin, begin + 10.0 / w0)
        found = solve_ivp(
            motion, span, [x, 0.0], "DOP853", events=turned, rtol=1e-10, atol=1e-12, dense_output=True
        )
        end = found.t_events[0][0]
        here = (t >= begin) & (t <= end)
        y = found.sol(t[here])
        signals[0][here], signals[1][here] = y
        signals[2][here] = -(w0**2) * (np.sin(y[0]) + d * sign)
        x, begin, sign = found.y_events[0][0][0], end, -sign
        turns.append(x)
    return signals, np.array(turns)


@pytest.fixture(scope="module")
def swings() -> tuple[list[np.ndarray], np.ndarray]:
    t = np.arange(0.0, 20.0, 0.002)
    return pendulum(6.5, 0.008, 1.0, t)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_pendulum(swings, order: int) -> None:
    signals, turns = swings
    name = ("angle", "angular_velocity", "angular_acceleration")[order]
    system = Pendulum(inertia=0.01, stiffness=0.01 * 6.5**2)
    decay = decay_of(
        signals[order],
        0.002,
        w=6.2,
        phase=0.0,
        quantity=QUANTITIES[name],
        unit=QUANTITIES[name].unit,
        system=system,
    )
    data = half_cycles(decay)
    if order == 0:
        j = data["turning_point"].values
        np.testing.assert_allclose(data["value"], turns[j], atol=2e-4)
        assert data["half_period"][0] > 1.04 * data["half_period"][-1]
    samples = friction_samples(decay, "highest") / (0.01 * 6.5**2)
    # the torque at the turning point carries friction too, which asin(theta''/w0^2) leaves in: 1 % at 1 rad
    np.testing.assert_allclose(samples.mean(), 0.008, rtol=1e-3 if order < 2 else 1e-2)


def test_peaks_of_the_exact_decay() -> None:
    t = np.arange(0.0, 18.0, 0.001)
    for order in range(3):
        for phase in (0.0, 2.0, 5.0):
            truth = {"w": W, "phase": phase, "a": 240.0, "u": 1.0, "c": 37.0}
            decay = decay_of(coulomb(order, t, **truth), 0.001, order=order, phase=phase, start_time=3.0)
            for peaks in ("highest", "nominal"):
                time, amplitude = peak_amplitudes(decay, peaks)
                j = np.round((W * (time - 3.0) + phase + order * np.pi / 2) / np.pi)
                assert np.all(j % 2 == 0)
                assert np.all(np.diff(j) == 2)
                assert W * (t[-1] + 0.001) + phase + order * np.pi / 2 >= np.pi * (j[-1] + 1)
                # an acceleration peaks on the far side of its jump
                jump = 1.0 if order == 2 and peaks == "highest" else 0.0
                np.testing.assert_allclose(
                    amplitude, 240.0 - (2 * j - order) + jump, atol=0.06 + (order == 2) * (peaks == "nominal")
                )
            factor = decay.system.force_factor(decay.quantity)
            assert friction_samples(decay).mean() == pytest.approx(factor, rel=2e-3)


def test_successive_samples_telescope(rng: np.random.Generator) -> None:
    # lag-one correlation of 20 x 50 samples has an sd of at most 1/sqrt(1000) = 0.032; 4 sd: 6e-5
    t = np.arange(0.0, 18.0, 0.001)
    signal = coulomb(0, t, w=W, phase=0.0, a=240.0, u=1.0, c=0.0)
    pairs = []
    for _ in range(20):
        decay = decay_of(signal + rng.normal(0.0, 8.0, t.size), 0.001, phase=0.0)
        error = friction_samples(decay, "nominal") / decay.system.stiffness - 1.0
        assert error.std() == pytest.approx(8.0 * np.sqrt(2.0) / 4.0, rel=0.5)
        pairs.append(np.stack([error[:-1], error[1:]]))
        assert error.sum() == pytest.approx(
            np.subtract(*peak_amplitudes(decay, "nominal")[1][[0, -1]]) / 4 - error.size
        )
    assert np.corrcoef(np.hstack(pairs))[0, 1] == pytest.approx(-0.5, abs=0.13)


def test_uncalibrated_signal_keeps_its_own_unit() -> None:
    t = np.arange(0.0, 10.0, 0.001)
    signal = coulomb(1, t, w=W, phase=0.0, a=240.0, u=1.0, c=0.0)
    assert friction_samples(decay_of(signal, 0.001, order=1, phase=0.0, unit="V")).mean() == pytest.approx(
        1.0, rel=2e-3
    )


def test_refusals() -> None:
    t = np.arange(0.0, 0.3, 0.01)
    short = decay_of(coulomb(0, t, w=W, phase=1.0, a=240.0, u=1.0, c=0.0), 0.01, phase=1.0)
    with pytest.raises(InputError, match=r"test record: 0 complete period.*waveform"):
        friction_samples(short)
    with pytest.raises(InputError, match=r"peaks: unknown choice 'lowest'"):
        friction_samples(short, "lowest")
    with pytest.raises(InputError, match=r"1 turning points can be fitted"):
        half_cycles(short)
    t = np.arange(0.0, 10.0, 0.01)
    fast = decay_of(
        coulomb(0, t, w=W, phase=1.0, a=240.0, u=1.0, c=0.0),
        0.01,
        phase=1.0,
        quantity=QUANTITIES["angular_velocity"],
        unit="rad/s",
        system=Pendulum(inertia=1.0, stiffness=W**2),
    )
    with pytest.raises(InputError, match=r"rad/s exceeds any swing of the declared pendulum"):
        friction_samples(fast)
