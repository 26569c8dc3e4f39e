"""Efficiency and coverage of the estimators, with Monte Carlo errors.

``python -m benchmarks.accuracy [--systems N] [--repeats R] [--seed S] [--page PAGE]`` prints one row a cell:
quantity, the paper's example or random systems, signal-to-noise ratio; ``--page`` puts the rows between the
markers of a Markdown page. Efficiency is the Cramer-Rao bound's variance over the mean squared error. Its
Monte Carlo error is made small by a control variate: the unbiased estimator that is linear in the noise and
knows the truth has exactly the bound's variance, on the same noise.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from experiments.cramer_rao import Decay, bound_row, exact_decay, paper_decay, rest_position
from friction_bayes import Oscillator, estimate_batch
from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.testbed import PAPER_RELEASE

METHODS = ("waveform", "envelope", "normal-gamma")
QUANTITIES = ("displacement", "velocity", "acceleration")
DECIBELS = (8.0, 12.0, 20.0, 30.0)
NORMAL_WIDTH = 2.0 * 1.6448536269514722
"""Width of a 90 % interval in standard deviations."""


def random_decay(rng: np.random.Generator, order: int) -> Decay:
    """A random system: half start in mid-motion, half end before rest."""
    frequency = np.exp(rng.uniform(0.0, np.log(100.0)))
    half_cycles = rng.uniform(8.0, 100.0)
    per_period = np.exp(rng.uniform(np.log(10.0), np.log(300.0)))
    phase = rng.uniform(0.0, 2.0 * np.pi) if rng.random() < 0.5 else 0.0
    length = half_cycles * (rng.uniform(0.5, 0.95) if rng.random() < 0.5 else rng.uniform(1.05, 1.5))
    step = 2.0 * np.pi / (frequency * per_period)
    time = np.arange(int(length * np.pi / frequency / step)) * step
    system = Oscillator(mass=1.0, stiffness=frequency**2)
    return exact_decay(system, 0.5 / half_cycles, 1.0, phase, rng.uniform(-1.0, 1.0), time, order)


def measure(
    decays: list[tuple[Decay, float]],
    decibels: float,
    repeats: int,
    rng: np.random.Generator,
    methods: Sequence[str] = METHODS,
) -> tuple[Array, dict[str, Array]]:
    """Errors of the efficient linear estimator, shape (records,), and figures of every method.

    By method, shape (3, records): its error, whether its 90 % interval covers the truth, and the interval's
    width over that of an efficient estimator that knows the noise level. Errors are over the bound's standard
    deviation; nan where a record was refused.
    """
    linear: list[Array] = []
    rows: dict[str, list[Array]] = {method: [] for method in methods}
    for decay, amplitude in decays:
        weights = bound_row(decay, amplitude)
        centred = decay.signal[: decay.moving] - rest_position(decay)
        noise_sd = np.sqrt(np.mean(centred**2) / 10.0 ** (decibels / 10.0))
        noise = noise_sd * rng.standard_normal((repeats, decay.time.size))
        factor = decay.system.natural_frequency**-decay.order * decay.system.stiffness
        bound = factor * noise_sd * np.linalg.norm(weights)
        linear.append(factor * noise[:, : decay.moving] @ weights / bound)
        for method, found in rows.items():
            result = estimate_batch(
                decay.signal + noise,
                decay.system,
                sampling_rate=1.0 / (decay.time[1] - decay.time[0]),
                quantity=QUANTITIES[decay.order],
                method=method,
                # under the law that the records have: losses that they lack are not averaged over
                random_force="none",
                judge=False,
            )
            low, high = result["friction_interval90"].values.T
            hit = (low <= decay.friction) & (decay.friction <= high)
            error = (result["friction_mean"].values - decay.friction) / bound
            found.append(np.stack([error, hit, (high - low) / (NORMAL_WIDTH * bound)]))
    return np.concatenate(linear), {method: np.concatenate(found, axis=1) for method, found in rows.items()}


def cell_text(linear: Array, figures: Array) -> tuple[str, str, str]:
    """Efficiency and coverage with their Monte Carlo errors, and median width, of one method in one cell."""
    found = np.isfinite(figures[0])
    error, hit, width = figures[:, found]
    excess = error**2 - linear[found] ** 2
    efficiency = 1.0 / (1.0 + excess.mean())
    uncertainty = efficiency**2 * excess.std() / np.sqrt(excess.size)
    coverage = hit.mean()
    deviation = np.sqrt(coverage * (1.0 - coverage) / hit.size)
    lost = f" ({np.count_nonzero(~found)} refused)" if not found.all() else ""
    ratio = (
        f"{efficiency:.3f} ± {uncertainty:.3f}"
        if efficiency > 0.1
        else f"{efficiency:.1g} ({np.sqrt(1.0 / efficiency):.0f} x the bound's sd)"
    )
    return ratio, f"{100.0 * coverage:.1f} ± {100.0 * deviation:.1f}{lost}", f"{np.median(width):.3g}"


def cells(options: argparse.Namespace) -> Iterator[tuple[str, ...]]:
    """Measure one cell after the other: the texts of a row."""
    for order, quantity in enumerate(QUANTITIES):
        for kind in ("paper", "random"):
            for decibels in DECIBELS:
                rng = np.random.default_rng([options.seed, order, kind == "paper", int(10 * decibels)])
                if kind == "paper":
                    decays, repeats = [(paper_decay(order), PAPER_RELEASE)], 10 * options.repeats
                else:
                    decays = [(random_decay(rng, order), 1.0) for _ in range(options.systems)]
                    repeats = options.repeats
                linear, figures = measure(decays, decibels, repeats, rng)
                texts = [text for method in METHODS for text in cell_text(linear, figures[method])]
                yield (quantity, kind, f"{decibels:.0f}", str(linear.size), *texts)


def written_between(page: Path, results: str, lines: Sequence[str]) -> None:
    """Put lines between the markers of a page that belong to some results."""
    text = page.read_text(encoding="utf-8")
    marker = f"<!-- results: {results} -->"
    begin = text.index(marker) + len(marker)
    end = text.index("<!-- end -->", begin)
    table = "\n".join(lines)
    page.write_text(f"{text[:begin]}\n\n{table}\n\n{text[end:]}", encoding="utf-8")


def main() -> None:
    """Measure every cell and print it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy", description=__doc__)
    parser.add_argument("--systems", type=int, default=200, help="random systems a cell")
    parser.add_argument("--repeats", type=int, default=10, help="noise records a system")
    parser.add_argument("--seed", type=int, default=20261121)
    parser.add_argument("--page", type=Path, help="Markdown page to put the table into")
    options = parser.parse_args()
    headings = ["quantity", "systems", "SNR [dB]", "records"]
    for method in METHODS:
        headings += [f"{method}: efficiency", "covers [%]", "width"]
    lines = [f"| {' | '.join(headings)} |", f"|{'---|' * len(headings)}"]
    print("\n".join(lines))
    for texts in cells(options):
        lines.append(f"| {' | '.join(texts)} |")
        print(lines[-1], flush=True)
    if options.page is not None:
        how = f"`python -m benchmarks.accuracy --systems {options.systems} --repeats {options.repeats}`"
        how += f", seed {options.seed}."
        written_between(options.page, "accuracy", [how, "", *lines])


if __name__ == "__main__":
    main()
