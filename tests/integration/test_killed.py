"""A run killed at any moment, its workers with it, goes on to the same bits and does only what was lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from decays import short_decay
from fleets import numbers_of, write_fleet

ROOT = Path(__file__).resolve().parents[2]
PARTS, KILLS = 8, 2
# what is done is noted as it begins
FLEET = """
from pathlib import Path
import friction_bayes as fb
from friction_bayes.cli import fleet_estimate
from friction_bayes.cli.program import main
from friction_bayes.records import fleet

fleet._BLOCK_BYTES = 1
write_whole = fleet_estimate.write_whole

def noted(file, write):
    with Path("begun").open("a") as lines:
        lines.write(f"{file.name}\\n")
    write_whole(file, write)

fleet_estimate.write_whole = noted
options = "--mass 10 --stiffness 1000 --random-force none --workers 1 --resume"

# kernels are loaded once
machine = fb.Oscillator(mass=10.0, stiffness=1000.0)
setting = {"friction": 0.3, "initial_displacement": 0.02, "duration": 4.0, "sampling_rate": 100.0}
decay = fb.simulate(machine, **setting, noise_sd=1e-4, seed=1)
fb.estimate_batch(decay.expand_dims("record"), machine, random_force="none")

def run(out):
    return main(["estimate", "fleet.zarr", *options.split(), "--out", f"{out}/out.zarr"])
"""
EXPERIMENT = """
import time
from dataclasses import dataclass
from pathlib import Path
import numpy as np
import xarray as xr
from experiments.runner import Experiment, Row, main

@dataclass(frozen=True)
class Config:
    cells: int = 8

def cell(config, cell, seed):
    with Path("begun").open("a") as lines:
        lines.write(f"{cell['k']}\\n")
    time.sleep(0.05)
    return {"drawn": np.random.default_rng(seed).standard_normal(1000).tolist()}

experiment = Experiment(
    name="noise_sweep",
    question="does a killed run go on?",
    config=Config(),
    cells=lambda config, full: [{"k": k} for k in range(config.cells)],
    run=cell,
    assemble=lambda cells, results: xr.Dataset({"drawn": (("k", "i"), [each["drawn"] for each in results])}),
    rows=lambda dataset: [Row("cells", str(dataset.sizes["k"]))],
)

def run(out):
    main(experiment, ["--workers", "1", "--results", out])
    return 0
"""
# each run is a process of its own, a copy of one that has loaded what all need and has written nothing
EACH = """
import os
import sys

for line in sys.stdin:
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.setsid()
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            status = run(line.strip())
        finally:
            os._exit(status)
    print(child, flush=True)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


@pytest.mark.parametrize("program", [FLEET, EXPERIMENT], ids=["fleet", "experiment"])
def test_a_killed_run_goes_on(program: str, tmp_path: Path, rng: np.random.Generator) -> None:
    records = [[short_decay(friction=0.3 + 0.01 * k, duration=4.0, seed=k)] for k in range(PARTS)]
    write_fleet(tmp_path / "fleet.zarr", records)
    (tmp_path / "run.py").write_text(program + EACH)

    def begun() -> list[str]:
        return (tmp_path / "begun").read_text().split() if (tmp_path / "begun").exists() else []

    def run(out: str, killed_after: tuple[int, float] | None = None) -> None:
        """Run to the end, or kill it some parts later, and some seconds [s] into a part."""
        (tmp_path / out).mkdir(exist_ok=True)
        before = len(begun())
        print(out, file=asked, flush=True)
        process = int(answered.readline())
        if killed_after is None:
            assert int(answered.readline()) == 0
            return
        parts, moment = killed_after
        while len(begun()) < before + parts:
            os.kill(process, 0)  # it lives
            time.sleep(0.002)
        time.sleep(moment)
        os.killpg(process, signal.SIGKILL)
        assert int(answered.readline()) == -signal.SIGKILL

    with subprocess.Popen(
        [sys.executable, "run.py"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as runs:
        asked, answered = runs.stdin, runs.stdout
        assert asked is not None
        assert answered is not None
        run("whole")
        assert len(begun()) == PARTS
        (tmp_path / "begun").unlink()
        for _ in range(KILLS):
            run("killed", (int(rng.integers(1, 4)), rng.uniform(0.0, 0.03)))
        run("killed")
    assert len(set(begun())) == PARTS
    assert len(begun()) <= PARTS + KILLS
    assert numbers_of(tmp_path / "killed") == numbers_of(tmp_path / "whole")
