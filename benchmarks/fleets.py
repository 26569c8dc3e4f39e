"""Fleets larger than memory, on workers that die: memory, lost work and speed-up.

``python -m benchmarks.fleets memory|worker|kills|speed [--folder DIR] [--page PAGE]`` prints a
table; ``--page`` puts it between the markers of a Markdown page. Fleets are records of the paper's example,
32,000 samples each, in double precision, 500 a chunk.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import median

import numpy as np
import psutil
import xarray as xr

from benchmarks.accuracy import written_between
from benchmarks.throughput import RATE, SAMPLES, paper_records

CHUNK = 500
"""Records, 128 MB."""
SYSTEM = ("--mass", "10", "--stiffness", "1000")
RUN = (sys.executable, "-m", "friction_bayes", "estimate")
QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
DATED = {".zattrs", ".zmetadata"}


def make_fleet(path: Path, chunks: int) -> Path:
    """Write a fleet, a chunk at a time; the noise is that of the first chunk, shifted."""
    shutil.rmtree(path, ignore_errors=True)
    records = paper_records(CHUNK)
    for k in range(chunks):
        rows = xr.Dataset(
            {"displacement": (("record", "time"), np.roll(records, k, axis=0), {"units": "m"})},
            coords={"time": np.arange(SAMPLES) / RATE},
        )
        new = {"encoding": {"displacement": {"chunks": (CHUNK, SAMPLES), "compressors": None}}}
        rows.to_zarr(
            path,
            zarr_format=2,
            consolidated=False,
            **(new if k == 0 else {"append_dim": "record", "mode": "a"}),
        )
    return path


def numbers_of(result: Path) -> dict[str, bytes]:
    """All files of a result but those that say when it was made."""
    files = [path for path in result.rglob("*") if path.is_file() and path.name not in DATED]
    return {path.relative_to(result).as_posix(): path.read_bytes() for path in files}


def parts_of(out: Path, suffix: str) -> dict[str, int]:
    """Parts that are kept of a run, and when each was written."""
    found = out.parent.glob(f".{out.name}.parts-*/[0-9]*{suffix}")
    return {path.name: path.stat().st_mtime_ns for path in found}


def kill_whole(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and all that it has started, at once."""
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def estimate(fleet: Path, out: Path, *options: str) -> subprocess.Popen[bytes]:
    """Start the command."""
    return subprocess.Popen([*RUN, str(fleet), *SYSTEM, "--out", str(out), *options], **QUIET)


def resident(process: psutil.Process) -> int:
    """Memory of a process and all that it has started, bytes; what they share counts for each."""
    total = 0
    for each in [process, *process.children(recursive=True)]:
        try:
            total += each.memory_info().rss
        except psutil.NoSuchProcess:
            continue
    return total


def peak_and_time(started: subprocess.Popen[bytes]) -> tuple[int, float]:
    """Largest memory in use [bytes] until a command ends well, and the time it takes [s]."""
    begin, peak = time.perf_counter(), 0
    process = psutil.Process(started.pid)
    while started.poll() is None:
        peak = max(peak, resident(process))
        time.sleep(0.05)
    assert started.returncode == 0
    return peak, time.perf_counter() - begin


def memory_table(folder: Path, chunks: Sequence[int]) -> list[str]:
    """Peak memory over the size of the fleet."""
    lines = ["| fleet, GB | records | peak memory of all processes, GB | s |", "|---|---|---|---|"]
    for count in chunks:
        fleet = make_fleet(folder / "fleet.zarr", count)
        peak, seconds = peak_and_time(estimate(fleet, folder / "out.zarr", "--workers", "2", "--force"))
        size = count * CHUNK * SAMPLES * 8 / 1e9
        lines.append(f"| {size:.1f} | {count * CHUNK} | {peak / 1e9:.2f} | {seconds:.0f} |")
        print(lines[-1], flush=True)
    return lines


@contextmanager
def cluster(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Start a scheduler and two workers from the command line; yield its address and the workers."""
    address_file = folder / "scheduler.json"
    address_file.unlink(missing_ok=True)
    dask = (sys.executable, "-m", "dask")
    where = ("--scheduler-file", str(address_file))
    options = (*where, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--memory-limit", "0")
    scheduler = subprocess.Popen(
        [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", *where], **QUIET
    )
    workers = [subprocess.Popen([*dask, "worker", *options], **QUIET) for _ in range(2)]
    try:
        while not address_file.exists():
            time.sleep(0.1)
        address = json.loads(address_file.read_text())["address"]
        from dask.distributed import Client

        with Client(address, set_as_default=False) as client:
            client.wait_for_workers(2)
        yield address, workers
    finally:
        for each in [*workers, scheduler]:
            if each.poll() is None:
                kill_whole(each)


def worker_table(folder: Path, chunks: int) -> list[str]:
    """Kill one of two workers in mid-run."""
    fleet = make_fleet(folder / "fleet.zarr", chunks)
    assert estimate(fleet, folder / "whole.zarr", "--workers", "1").wait() == 0
    out = folder / "out.zarr"
    with cluster(folder) as (address, workers):
        run = estimate(fleet, out, "--scheduler", address)
        while len(parts_of(out, ".nc")) < chunks // 3:
            time.sleep(0.02)
        kill_whole(workers[0])
        at = len(parts_of(out, ".nc"))
        assert run.wait() == 0
    same = numbers_of(out) == numbers_of(folder / "whole.zarr")
    return [
        "| parts | done when one of two workers is killed | the same bits as in one process |",
        "|---|---|---|",
        f"| {chunks} | {at} | {'yes' if same else 'NO'} |",
    ]


def killed(
    start: Callable[[], subprocess.Popen[bytes]],
    parts: Callable[[], dict[str, int]],
    clear: Callable[[], None],
    times: int,
    longest: float,
) -> tuple[list[int], int]:
    """Start and kill a run, each time at a random moment; return parts kept at each, and those done again.

    A run that is through before its moment has come is cleared away, and another one begins.
    """
    chance = random.Random(1)
    kept: dict[str, int] = {}
    counts: list[int] = []
    again = 0
    while len(counts) < times:
        run = start()
        time.sleep(chance.uniform(0.0, longest))
        if run.poll() is not None:
            assert run.returncode == 0
            clear()
            kept = {}
            continue
        kill_whole(run)
        now = parts()
        again += sum(now.get(name) != written for name, written in kept.items())
        counts.append(len(now))
        print(f"killed with {len(now)} parts", flush=True)
        kept = now
    return counts, again


def listed(numbers: Sequence[int]) -> str:
    """Write numbers one after another."""
    return ", ".join(map(str, numbers))


KILLS_HEAD = [
    "| run | parts | kills | parts kept at each | kept parts done again | the same bits |",
    "|---|---|---|---|---|---|",
]


def kills_table(folder: Path, chunks: int, times: int, longest: float) -> list[str]:
    """Kill a whole run at random moments."""
    fleet, out = make_fleet(folder / "fleet.zarr", chunks), folder / "out.zarr"
    assert estimate(fleet, folder / "whole.zarr", "--workers", "2").wait() == 0
    options = ("--workers", "2", "--resume")
    kept, again = killed(
        lambda: estimate(fleet, out, *options),
        lambda: parts_of(out, ".nc"),
        lambda: shutil.rmtree(out),
        times,
        longest,
    )
    assert estimate(fleet, out, *options).wait() == 0
    same = numbers_of(out) == numbers_of(folder / "whole.zarr")
    left = [path.name for path in folder.iterdir() if path.name.startswith(".")]
    assert not left, left
    return [
        *KILLS_HEAD,
        f"| `estimate` | {chunks} | {times} | {listed(kept)} | {again} | {'yes' if same else 'NO'} |",
    ]


def speed_table(folder: Path, chunks: int, repeats: int) -> list[str]:
    """Two workers of a cluster against two processes that know nothing of each other, in turn."""
    fleet = make_fleet(folder / "fleet.zarr", chunks)
    halves = [make_fleet(folder / f"half{k}.zarr", chunks // 2) for k in range(2)]
    alone, together = [], []
    for _ in range(repeats):
        begin = time.perf_counter()
        runs = [
            estimate(half, half.with_name(f"{half.stem}-out.zarr"), "--workers", "1", "--force")
            for half in halves
        ]
        assert [run.wait() for run in runs] == [0, 0]
        alone.append(time.perf_counter() - begin)
        with cluster(folder) as (address, _):
            begin = time.perf_counter()
            assert estimate(fleet, folder / "out.zarr", "--scheduler", address, "--force").wait() == 0
            together.append(time.perf_counter() - begin)
        print(f"{alone[-1]:.1f} s, {together[-1]:.1f} s", flush=True)
    ratio = median(a / b for a, b in zip(alone, together, strict=True))
    texts = [", ".join(f"{each:.1f}" for each in times) for times in (alone, together)]
    return [
        "| fleet, GB | two processes, s | two workers, s | speed of two workers over two processes |",
        "|---|---|---|---|",
        f"| {chunks * CHUNK * SAMPLES * 8 / 1e9:.1f} | {texts[0]} | {texts[1]} | {ratio:.2f} |",
    ]


def main() -> None:
    """Measure, and print or write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fleets", description=__doc__)
    parser.add_argument("what", choices=("memory", "worker", "kills", "speed"))
    parser.add_argument("--chunks", type=int, nargs="+", default=[16, 32], help="size of the fleet, or sizes")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--longest", type=float, default=10.0, help="latest moment of a kill [s]")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--folder", type=Path, help="where fleets and results go; they are removed")
    parser.add_argument("--page", type=Path, help="Markdown page to put the table into")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as temporary:
        folder, (chunks, *_) = Path(temporary), options.chunks
        lines = {
            "memory": lambda: memory_table(folder, options.chunks),
            "worker": lambda: worker_table(folder, chunks),
            "kills": lambda: kills_table(folder, chunks, options.kills, options.longest),
            "speed": lambda: speed_table(folder, chunks, options.repeats),
        }[options.what]()
    print("\n".join(lines))
    if options.page is not None:
        written_between(options.page, f"fleets {options.what}", lines)


if __name__ == "__main__":
    main()
