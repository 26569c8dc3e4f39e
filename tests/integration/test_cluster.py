"""``--scheduler``: a scheduler and two workers, started from the command line, one of which is killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from experiments.runner import Experiment, Row, main

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[str]:
    """Address of a scheduler of this computer, with two workers that nobody starts again."""
    reported = tmp_path / "scheduler.json"
    where = ("--scheduler-file", str(reported))
    dask = (sys.executable, "-m", "dask")
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    commands = (
        (*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", *where),
        *((*dask, "worker", *where, "--nthreads", "1", "--no-nanny", "--no-dashboard"),) * 2,
    )
    quiet: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    started = [subprocess.Popen(each, env=environment, cwd=tmp_path, **quiet) for each in commands]
    try:
        while not reported.exists():
            assert started[0].poll() is None
            time.sleep(0.1)
        yield json.loads(reported.read_text())["address"]
    finally:
        for each in started:
            each.kill()
            each.wait()


@dataclass(frozen=True)
class Config:
    cells: int = 8


def test_a_killed_worker_changes_no_bit(scheduler: str, tmp_path: Path) -> None:
    died = tmp_path / "died"

    def cell(config: Config, cell: Any, seed: np.random.SeedSequence) -> dict[str, Any]:
        if cell["k"] == 3 and not died.exists() and os.getpid() != here:
            died.write_text(str(os.getpid()))
            os.kill(os.getpid(), signal.SIGKILL)
        return {"drawn": float(np.random.default_rng(seed).standard_normal())}

    here = os.getpid()
    experiment = Experiment(
        # whose sources are digested
        name="noise_sweep",
        question="does a lost cell come back?",
        config=Config(),
        cells=lambda config, full: [{"k": k} for k in range(config.cells)],
        run=cell,
        assemble=lambda cells, results: xr.Dataset({"drawn": ("k", [each["drawn"] for each in results])}),
        rows=lambda dataset: [Row("cells", str(dataset.sizes["k"]))],
    )
    alone = main(experiment, ["--workers", "1", "--results", str(tmp_path / "alone")])
    spread = main(experiment, ["--scheduler", scheduler, "--results", str(tmp_path / "spread")])
    assert died.exists()
    xr.testing.assert_identical(spread, alone)
