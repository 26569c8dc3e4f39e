"""A spectral line as a linear problem: its evidence against numerical integration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from friction_bayes.loop.search.spectral_lines import SpectralLine, follows_motion
from scipy import special

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.loop.data.parameters import effect_coordinates
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.mechanics.effects import Scales

N, STEP, NOISE = 400, 0.01, 0.02
TIME = STEP * np.arange(N)
SCALES = Scales(
    system=fb.Oscillator(mass=1.0, stiffness=100.0),
    quantity=QUANTITIES["displacement"],
    amplitude=1.0,
    duration=N * STEP,
    sampling_rate=1.0 / STEP,
)
COORDINATES = effect_coordinates("periodic_interference", SCALES, 1)
AMPLITUDE, FREQUENCY, PHASE = (c.prior for c in COORDINATES)


def log_likelihood_ratio(signal: np.ndarray, columns: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Log-likelihood of sines and cosines, shape (..., 2), over that of none."""
    cross, gram = columns.T @ signal / NOISE**2, columns.T @ columns / NOISE**2
    return coefficients @ cross - 0.5 * np.einsum("...i,ij,...j", coefficients, gram, coefficients)


def integrated(signal: np.ndarray, frequency: float, width: float) -> float:
    """Log of the likelihood ratio integrated over amplitude, frequency and phase, by a product rule."""
    amplitudes = np.linspace(0.0, 0.2, 400)
    phases = np.linspace(-math.pi, math.pi, 240, endpoint=False)
    frequencies = np.linspace(frequency - 8.0 * width, frequency + 8.0 * width, 81)
    size, phase = np.meshgrid(amplitudes, phases, indexing="ij")
    polar = np.stack([size * np.cos(phase), size * np.sin(phase)], axis=-1)
    log_prior = AMPLITUDE.log_density(size) + FREQUENCY.log_density(frequency) + PHASE.log_density(phase)
    logs = []
    for f in frequencies:
        angle = 2.0 * math.pi * f * TIME
        columns = np.column_stack([np.sin(angle), np.cos(angle)])
        logs.append(special.logsumexp(log_prior + log_likelihood_ratio(signal, columns, polar)))
    cell = (amplitudes[1] - amplitudes[0]) * (phases[1] - phases[0]) * (frequencies[1] - frequencies[0])
    return float(special.logsumexp(logs)) + math.log(cell)


@pytest.mark.parametrize(("amplitude", "phase"), [(0.02, 0.6), (0.06, -2.0), (0.15, 1.4)])
def test_evidence_of_a_line_is_the_integral(amplitude: float, phase: float, rng: np.random.Generator) -> None:
    """To a tenth: sine and cosine as a linear problem, times the volume of the line."""
    true = 7.3
    signal = amplitude * np.sin(2.0 * math.pi * true * TIME + phase) + NOISE * rng.standard_normal(N)
    # the frequency of the largest likelihood, as the search takes it from a finely sampled periodogram
    trials = np.linspace(true - 0.1, true + 0.1, 2001)
    angles = 2.0 * math.pi * np.outer(trials, TIME)
    frequency = float(trials[np.argmax(np.abs(np.exp(1j * angles) @ signal))])
    angle = 2.0 * math.pi * frequency * TIME
    columns = np.column_stack([np.sin(angle), np.cos(angle)])
    line = SpectralLine(frequency, N * STEP, [columns])
    gram = columns.T @ columns / NOISE**2
    precision = gram + np.diag(line.prior(COORDINATES))
    mode = np.linalg.solve(precision, columns.T @ signal / NOISE**2)
    energy = float(mode @ gram @ mode)
    laplace = float(log_likelihood_ratio(signal, columns, mode)) - 0.5 * line.prior(COORDINATES)[0] * float(
        mode @ mode
    )
    laplace += math.log(2.0 * math.pi) - 0.5 * float(np.linalg.slogdet(precision)[1])
    laplace += line.log_volume(COORDINATES, mode, energy)
    width = math.sqrt(12.0 / energy) / (2.0 * math.pi * N * STEP)
    assert laplace == pytest.approx(integrated(signal, frequency, width), abs=0.1)


def test_start_gives_the_line_that_the_coefficients_describe() -> None:
    line = SpectralLine(7.3, N * STEP, [np.zeros((N, 2))])
    sine, cosine = 0.03, -0.04
    start = line.start(COORDINATES, np.array([sine, cosine]))
    amplitude, frequency, phase = (float(c.value(z)) for c, z in zip(COORDINATES, start, strict=True))
    angle = 2.0 * math.pi * 7.3 * TIME
    np.testing.assert_allclose(
        amplitude * np.sin(2.0 * math.pi * frequency * TIME + phase),
        sine * np.sin(angle) + cosine * np.cos(angle),
        atol=1e-12,
    )


@pytest.mark.parametrize("multiple", [1, 2, 3])
def test_a_line_at_a_harmonic_of_the_motion_is_the_motion(multiple: int) -> None:
    """Within half a line width, one over the length of the record, and no further."""
    segment = cut_records([short_decay()], SYSTEM)[0]
    harmonic = multiple * segment.decay.frequency / (2.0 * math.pi)
    near, far = 0.9 / segment.duration, 1.1 / segment.duration
    lines = harmonic + np.array([-far, -near, 0.0, near, far])
    assert np.array_equal(follows_motion(lines, segment), [False, True, True, True, False])


def test_a_line_far_above_the_motion_is_none_of_it() -> None:
    segment = cut_records([short_decay()], SYSTEM)[0]
    assert not follows_motion(10.0 * segment.decay.frequency / (2.0 * math.pi), segment)
