"""Eight statistics that the page on the paper quotes, computed again from its equations in NumPy alone.

Nothing of the package or of the experiments is used: the decay is Coulomb's, half cycle by half cycle, the
peaks are picked by the period, and what is compared with is the text of the tables in the documentation.
"""

from __future__ import annotations

import math
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

TABLES = (Path(__file__).parents[2] / "docs" / "experiments.md").read_text(encoding="utf-8")
MASS, STIFFNESS, FRICTION, RELEASE, NOISE = 10.0, 1000.0, 0.07, 0.0147, 5e-4
RATE, DURATION, RECORDS, SEED = 1000.0, 33.0, 400, 5
READINGS = ("highest", "nominal")
BY_READING = pytest.mark.parametrize("name", READINGS)
ERRORS = {21.59: 0.8, 14.7: 0.33, 8.6: 2.7}
"""The paper's errors [%] by signal-to-noise ratio [dB], the first that of the noise it states."""
CLEAR = 4.0
"""Standard errors that two independent computations of one statistic may be apart."""

PERIOD = 2.0 * math.pi / math.sqrt(STIFFNESS / MASS)
PEAKS = int(RELEASE * STIFFNESS / FRICTION / 4.0)


def decay() -> tuple[np.ndarray, np.ndarray]:
    """Time and displacement of a mass let go: each half cycle a cosine about the friction's own centre."""
    time = np.arange(round(DURATION * RATE)) / RATE
    shift = FRICTION / STIFFNESS
    half = np.minimum(2.0 * time // PERIOD, math.floor((RELEASE / shift + 1.0) / 2.0)).astype(int)
    size = RELEASE - (2.0 * half + 1.0) * shift
    moving = size > 0.0
    value = np.where(moving, size * np.cos(2.0 * math.pi * time / PERIOD), 0.0)
    return time[moving], (value + shift * (-1.0) ** half)[moving]


@cache
def samples(decibels: float) -> dict[str, np.ndarray]:
    """Friction samples ``k (A_i - A_i+1)/4`` of many records by either reading, shape (records, samples)."""
    time, clean = decay()
    noise = NOISE if decibels == 21.59 else math.sqrt(np.mean(clean**2) / 10.0 ** (decibels / 10.0))
    rng = np.random.default_rng([SEED, round(100.0 * decibels)])
    picked: dict[str, list[np.ndarray]] = {name: [] for name in READINGS}
    within = [np.flatnonzero(abs(time - j * PERIOD) <= 0.5 * PERIOD) for j in range(1, PEAKS + 1)]
    due = [round(j * PERIOD * RATE) for j in range(1, PEAKS + 1)]
    for _ in range(RECORDS):
        record = clean + rng.normal(0.0, noise, clean.size)
        picked["highest"].append(np.array([record[part].max() for part in within]))
        picked["nominal"].append(record[due])
    return {name: -0.25 * STIFFNESS * np.diff(np.array(each), axis=1) for name, each in picked.items()}


def precision(values: np.ndarray) -> np.ndarray:
    """Posterior mean ``alpha/beta`` of Eqs. (7) and (8) with next to no prior: alpha 1/2, beta 0."""
    n = values.shape[-1]
    return (0.5 + 0.5 * n) / (0.5 * values.var(axis=-1) * n)


def ranks(values: np.ndarray) -> np.ndarray:
    return np.argsort(np.argsort(values, axis=-1), axis=-1).astype(float)


def rank_correlation(used: list[int], values: np.ndarray) -> np.ndarray:
    """Of precision and size of the error over the numbers of samples used, record by record."""
    found = [(precision(values[:, :n]), abs(values[:, :n].mean(axis=1) - FRICTION)) for n in used]
    first, second = (ranks(np.array([pair[k] for pair in found]).T) for k in (0, 1))
    return np.array([np.corrcoef(a, b)[0, 1] for a, b in zip(first, second, strict=True)])


def cell(row: str, column: int = 1) -> str:
    found = re.findall(rf"^\| {re.escape(row)} \|.*$", TABLES, re.MULTILINE)
    assert len(found) == 1, row
    return re.split(r"(?<!\\)\|", found[0])[column + 1].strip()


def near_median(values: np.ndarray, text: str, records: int = 200) -> None:
    """The median of ours and the one printed with its band of 90 % are as near as their errors allow."""
    printed = re.fullmatch(r"(\S+) \[(\S+), (\S+)\].*", text)
    assert printed
    middle, low, high = (float(each) for each in printed.groups())
    # of a normal distribution's median, from its band
    error = 1.2533 * (high - low) / 3.29 * math.sqrt(1.0 / records + 1.0 / values.size)
    assert abs(np.median(values) - middle) < CLEAR * error + 0.5e-2 * abs(middle)


def with_error(text: str) -> tuple[float, float]:
    value, error = text.split(" ± ")
    return float(value), float(error)


def as_close(name: str) -> list[float]:
    """Shares of the records whose error is as small as the paper's, level by level."""
    shares = []
    for decibels, stated in ERRORS.items():
        error = 100.0 * abs(samples(decibels)[name].mean(axis=1) / FRICTION - 1.0)
        shares.append(float((error <= stated).sum() + 1) / (RECORDS + 1))
    return shares


@BY_READING
def test_friction(name: str) -> None:
    row = f"21.59 dB (noise 5e-4 m): friction, normal-gamma, {name}"
    near_median(samples(21.59)[name].mean(axis=1), cell(row))


@BY_READING
def test_precision(name: str) -> None:
    row = f"21.59 dB (noise 5e-4 m): precision, normal-gamma, {name}"
    near_median(precision(samples(21.59)[name]), cell(row))


@BY_READING
def test_errors_as_noise_grows(name: str) -> None:
    for decibels in (14.7, 8.6):
        error = 100.0 * abs(samples(decibels)[name].mean(axis=1) / FRICTION - 1.0)
        near_median(error, cell(rf"{decibels} dB: \|error\|, normal-gamma, {name}"))


@BY_READING
def test_three_errors_together(name: str) -> None:
    row = f"three errors, normal-gamma, {name}: "
    printed = [float(share) for share in cell(row + "records as close").split(", ")]
    for ours, theirs in zip(as_close(name), printed, strict=True):
        common = (2.0 * ours + theirs) / 3.0
        error = math.sqrt(common * (1.0 - common) * (1.0 / RECORDS + 1.0 / 200.0))
        assert abs(ours - theirs) < CLEAR * error
    # the rest follows from these shares, each printed to two digits: 5 % at most
    product, rounded = math.prod(printed), 0.1
    independent, _ = with_error(cell(row + "all three, if independent"))
    assert abs(independent - product) < rounded * product + 5e-5
    # of the product of three uniform numbers
    chance = product * (1.0 - math.log(product) + 0.5 * math.log(product) ** 2)
    fisher, _ = with_error(cell(row + "Fisher's combined test"))
    assert abs(fisher - chance) < rounded * 0.5 * product * math.log(product) ** 2 + 5e-4


@BY_READING
def test_successive_samples_share_an_amplitude(name: str) -> None:
    values = samples(21.59)[name]
    centred = values - values.mean(axis=1, keepdims=True)
    lag = (centred[:, 1:] * centred[:, :-1]).sum(axis=1) / (centred**2).sum(axis=1)
    near_median(lag, cell(f"{name}: correlation of successive samples"))


@BY_READING
def test_error_of_the_mean_over_what_is_claimed(name: str) -> None:
    values = samples(21.59)[name]
    claimed = values.std(axis=1, ddof=1) / math.sqrt(values.shape[1])
    squares = ((values.mean(axis=1) - FRICTION) / claimed) ** 2
    root = math.sqrt(squares.mean())
    own = squares.std() / math.sqrt(RECORDS) / (2.0 * root)
    value, error = with_error(cell(f"{name}: RMS error of the mean over the standard error claimed"))
    assert abs(root - value) < CLEAR * math.hypot(error, own)


@BY_READING
def test_rank_correlation_depends_on_the_grid(name: str) -> None:
    row = f"{name}: rank correlation of precision and \\|error\\| along a record, "
    grids = {
        "every number of samples": list(range(2, 52)),
        "15 numbers spaced logarithmically": [2, 3, 4, 5, 7, 9, 12, 15, 19, 24, 29, 34, 39, 44, 51],
    }
    for reported, used in grids.items():
        near_median(rank_correlation(used, samples(21.59)[name]), cell(row + reported))


def test_gamma_exponential_finds_a_rate() -> None:
    values = samples(21.59)["highest"]
    # Eqs. (10) and (11) with next to no prior
    near_median(values.shape[1] / values.sum(axis=1), cell("true 0.07 N: posterior mean"))
