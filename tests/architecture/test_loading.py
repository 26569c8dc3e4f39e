"""What a command loads: help and refused options next to nothing, an estimate what it runs."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import friction_bayes as fb
from decays import short_decay
from friction_bayes.cli.commands import COMMANDS

COMPUTING = {"numba", "scipy", "xarray", "pandas", "dask", "distributed", "h5py", "h5netcdf", "pooch"}
SHOWING = {"emcee", "arviz", "arviz_base", "arviz_stats", "matplotlib", "rich"}
ABOVE = {f"friction_bayes.{layer}" for layer in ("reference", "monitor", "loop", "plotting", "report", "cli")}
NAMES = [command.__name__.rpartition(".")[2].replace("_", "-") for command in COMMANDS]


def ran(script: str) -> subprocess.CompletedProcess[str]:
    """Run a script in a Python of its own, which says at its end what it has loaded."""
    script += "\nimport json, sys\nprint()\nprint(json.dumps(sorted(sys.modules)))"
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)


def modules_of(done: subprocess.CompletedProcess[str]) -> set[str]:
    """Names of all modules that a script has loaded."""
    return set(json.loads(done.stdout.splitlines()[-1]))


def loaded(script: str) -> set[str]:
    """Run a script in a Python of its own and return the names of all modules that it has loaded."""
    return modules_of(ran(script))


def running(*arguments: str) -> str:
    return (
        "from friction_bayes.cli.program import main\n"
        f"try:\n    main({list(arguments)!r})\nexcept SystemExit:\n    pass"
    )


def test_import_loads_no_package() -> None:
    assert loaded("import friction_bayes") & {"numpy", *COMPUTING, *SHOWING} == set()


def test_help_and_refused_options_load_no_numerical_package() -> None:
    """One after the other in one process: what any loads is loaded at its end."""
    given = [("--help",), *((name, "--help") for name in NAMES), ("estimate", "--nonsense"), ("estimate",)]
    done = ran("\n".join(running(*arguments) for arguments in [*given, ("x",)]))
    assert all(f"usage: friction-bayes {name}" in done.stdout for name in NAMES)
    modules = modules_of(done)
    assert "friction_bayes.cli.program" in modules
    assert modules & {"jinja2", *COMPUTING, *SHOWING} == set()


def test_an_estimate_loads_what_it_runs(tmp_path: Path) -> None:
    record = fb.write_record(short_decay(seed=1), tmp_path / "decay.csv")
    done = ran(running("estimate", str(record), "--mass", "10", "--stiffness", "1000", "--json"))
    assert done.stderr == ""
    modules = modules_of(done)
    assert "friction_bayes.estimators.estimate" in modules
    # dask and jinja2 are not in it: xarray loads them wherever they are installed
    unused = {"dask.array", "distributed", "h5py", "h5netcdf", "pooch", "scipy.io"}
    assert modules & {*unused, *SHOWING, *ABOVE} == {"friction_bayes.cli"}


def test_closing_the_loop_loads_what_it_runs(tmp_path: Path) -> None:
    record = fb.write_record(short_decay(seed=1), tmp_path / "decay.csv")
    out = tmp_path / "loop"
    effects = ("--effects", "viscous_damping,sensor_offset,outliers,random_force")
    modules = loaded(
        running("close-loop", str(record), "--mass", "10", "--stiffness", "1000", *effects, "--out", str(out))
    )
    assert (out / "report.html").exists()
    assert "friction_bayes.loop.pipeline" in modules
    unused = {"dask.array", "distributed", "pooch", "scipy.io", "scipy.signal"}
    assert modules & {*unused, "emcee", "arviz", "arviz_base", "arviz_stats", "matplotlib.pyplot"} == set()
