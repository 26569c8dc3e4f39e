"""What a batch of records costs over one reading of its samples, and where the time goes.

``python -m benchmarks.throughput [--records M] [--page PAGE]`` prints tables; ``--page`` puts them between
the markers of a Markdown page. Times are processor times of one thread, the least of repetitions in turn
with those of ``numpy.sum`` over the same array, so that they mean the same on a busy machine.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import math
import re
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from scipy.signal import lfilter

from benchmarks.accuracy import written_between
from friction_bayes import RecordWarning, estimate_batch
from friction_bayes.core.arrays import Array
from friction_bayes.decay.excursions import excursions_possible
from friction_bayes.decay.leaps import leaps_possible
from friction_bayes.decay.located import FOUND
from friction_bayes.decay.location import locate_free_decays
from friction_bayes.decay.spans import extremes
from friction_bayes.estimators.waveform.glance import glance
from friction_bayes.estimators.waveform.least_squares import fit_waveforms
from friction_bayes.mechanics.simulate import simulate
from friction_bayes.mechanics.testbed import PAPER_FRICTION, PAPER_RELEASE, PAPER_SYSTEM

SAMPLES = 32_000
RATE = 1000.0
NOISE = 5e-4
"""Of the paper's example, 51 periods of 628 samples each [m]."""
PEAK, RESIDENT = "VmHWM", "VmRSS"


def paper_records(count: int, samples: int = SAMPLES, rate: float = RATE, seed: int = 1) -> Array:
    """Records of the paper's example under noise, each with its own place in the cycle and offset."""
    rng = np.random.default_rng(seed)
    period = round(2.0 * math.pi / PAPER_SYSTEM.natural_frequency * rate)
    decay = simulate(
        PAPER_SYSTEM,
        friction=PAPER_FRICTION * 32.0 * rate / samples,
        initial_displacement=PAPER_RELEASE,
        duration=(samples + period) / rate,
        sampling_rate=rate,
    ).values
    records = NOISE * rng.standard_normal((count, samples))
    for row, begin in zip(records, rng.integers(period, size=count), strict=True):
        row += decay[begin : begin + samples] + rng.uniform(-1.0, 1.0) * PAPER_RELEASE
    return records


def batch(records: Any, **options: Any) -> Any:
    """Estimate all of them, without warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordWarning)
        return estimate_batch(records, PAPER_SYSTEM, sampling_rate=options.pop("rate", RATE), **options)


def least_times(works: Sequence[Callable[[], Any]], repeats: int) -> list[float]:
    """Least processor time of each of some works, done in turn."""
    least = [math.inf] * len(works)
    for _ in range(repeats):
        for k, work in enumerate(works):
            started = process_time()
            work()
            least[k] = min(least[k], process_time() - started)
    return least


def over_sum(work: Callable[[], Any], records: Array, repeats: int = 3) -> tuple[float, float]:
    """Time of a work over that of the sum, and that of the sum."""
    work()
    slow, fast = least_times([work, records.sum], repeats)
    return slow / fast, fast


def peak_memory(work: Callable[[], Any]) -> int:
    """Most memory in use during a work, less that before [bytes]."""

    def status(key: str) -> int:
        found = re.search(rf"{key}:\s+(\d+)", Path("/proc/self/status").read_text())
        assert found is not None
        return 1024 * int(found.group(1))

    gc.collect()
    # or the work is given what others freed, which this process still has
    ctypes.CDLL(None).malloc_trim(0)
    Path("/proc/self/clear_refs").write_text("5")
    before = status(RESIDENT)
    work()
    return status(PEAK) - before


def peak_share(records: Array) -> float:
    """Most memory in use while a batch is estimated, less that before, over that of the records.

    Without a random force: a long look for one loads its kernels.
    """
    batch(records[: len(records) // 100], random_force="none")
    return peak_memory(lambda: batch(records, random_force="none")) / records.nbytes


def methods_table(records: Array) -> list[str]:
    """Time over that of the sum by method, type of number and kind of result."""
    short = batch(records)["random_force_probability"].isnull().values
    cases: dict[str, tuple[Any, dict[str, Any]]] = {
        "waveform": (records, {}),
        f"waveform, without {np.count_nonzero(~short)} that take a long look": (records[short], {}),
        "waveform, numbers alone": (records, {"judge": False, "random_force": "none"}),
        "waveform, float32": (records.astype(np.float32), {}),
        "waveform, int16": (np.round(records / 1e-6).astype(np.int16), {}),
        "normal-gamma": (records, {"method": "normal-gamma"}),
        "envelope": (records[:20], {"method": "envelope"}),
    }
    lines = ["| batch | over numpy.sum | ms a record |", "|---|---|---|"]
    for name, (given, options) in cases.items():
        like = records[: len(given)]
        ratio, total = over_sum(lambda given=given, options=options: batch(given, **options), like)
        lines.append(f"| {name} | {ratio:.0f} | {1e3 * ratio * total / len(given):.2f} |")
    return lines


def parts_table(records: Array) -> list[str]:
    """Processor time of each part of the default, for one record and one sample of it."""
    step, frequency = 1.0 / RATE, PAPER_SYSTEM.natural_frequency
    seen = extremes(records)
    located = locate_free_decays(records, step, frequency, 0, seen=seen)
    whose = located.start, located.stop, located.frequency, seen.gap, located.status == FOUND
    fits = fit_waveforms(records, located, 0, 0.0)

    def scan() -> None:
        excursions_possible(extremes(records))

    works: dict[str, Callable[[], Any]] = {
        "`numpy.sum`": records.sum,
        "extremes, flat tops, stray samples": scan,
        "leaps": lambda: leaps_possible(records, *whose),
        "where the decay lies": lambda: locate_free_decays(records, step, frequency, 0, seen=seen),
        "fit": lambda: fit_waveforms(records, located, 0, 0.0),
        "residual: whiteness, force, shape of the loss": lambda: glance(records, located, 0, fits),
        "all, with posteriors and table": lambda: batch(records),
    }
    for work in works.values():
        work()
    times = least_times(list(works.values()), 5)
    lines = ["| part | us a record | ns a sample | over numpy.sum |", "|---|---|---|---|"]
    for name, time in zip(works, times, strict=True):
        each = time / len(records)
        lines.append(f"| {name} | {1e6 * each:.0f} | {1e9 * each / SAMPLES:.2f} | {time / times[0]:.1f} |")
    return lines


def slopes_table(largest: int) -> list[str]:
    """Log-log slope of the time in samples and in records.

    Without a random force: which records take a long look for one is a matter of chance.
    """
    lines = ["| from | to | slope |", "|---|---|---|"]
    samples = [32_000, 128_000, 512_000]
    given = [paper_records(max(2_000_000 // n, 1), n) for n in samples]
    times = least_times([lambda each=each: batch(each, random_force="none") for each in given], 4)
    each = [time / len(records) for time, records in zip(times, given, strict=True)]
    slope = np.polyfit(np.log(samples), np.log(each), 1)[0]
    lines.append(f"| {samples[0]} samples | {samples[-1]} samples | {slope:.2f} |")
    many = paper_records(largest, 3200, 100.0)
    counts = [largest // 16, largest // 4, largest]
    times = least_times([lambda m=m: batch(many[:m], rate=100.0, random_force="none") for m in counts], 4)
    slope = np.polyfit(np.log(counts), np.log(times), 1)[0]
    lines.append(f"| {counts[0]} records | {counts[-1]} records | {slope:.2f} |")
    return lines


def long_look() -> str:
    """What a record costs that a glance cannot judge: noise of a colour lies over the white one."""
    rng = np.random.default_rng(5)
    records = paper_records(8, seed=3)
    records += NOISE * lfilter([0.5], [1.0, -0.5], rng.standard_normal(records.shape))
    batch(records[:1])
    times = least_times([lambda k=k: batch(records[k : k + 1]) for k in range(len(records))], 2)
    return f"A long look, at a record of coloured noise: {np.median(times):.2f} s."


def main() -> None:
    """Measure, and print or write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.throughput", description=__doc__)
    parser.add_argument("--records", type=int, default=1000)
    parser.add_argument("--page", type=Path, help="Markdown page to put the tables into")
    options = parser.parse_args()
    records = paper_records(options.records)
    peak = peak_share(records)
    fast = min(least_times([records.sum], 5))
    lines = [
        f"`python -m benchmarks.throughput --records {options.records}`; `numpy.sum` reads "
        f"{records.nbytes / fast / 1e9:.1f} GB/s.",
        "",
        *methods_table(records),
        "",
        *parts_table(records[: max(len(records) // 10, 1)]),
        "",
        *slopes_table(2 * options.records),
        "",
        f"Most memory in use beyond the records: {100.0 * peak:.0f} % of them.",
        "",
        long_look(),
    ]
    print("\n".join(lines))
    if options.page is not None:
        written_between(options.page, "throughput", lines)


if __name__ == "__main__":
    main()
