"""Folders are the layers: imports run downward only, and each folder holds what belongs there."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "friction_bayes"

# Lowest first. Folders of one layer stand side by side and do not import each other.
LAYERS: tuple[tuple[str, ...], ...] = (
    ("core",),
    ("records", "conjugate", "validation"),
    ("mechanics",),
    ("decay",),
    ("estimators",),
    ("reference", "monitor"),
    ("loop",),
    ("plotting", "report"),
    ("cli",),
)
RANK = {folder: rank for rank, layer in enumerate(LAYERS) for folder in layer}
TOP_LEVEL = {"__init__.py", "__main__.py", "testing.py", "py.typed"}
HEAVY = ("emcee", "arviz_base", "arviz_stats", "arviz_plots", "matplotlib")
FACES = ("reference", "plotting", "report", "cli", "__main__")


def module_name(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(path: Path) -> set[str]:
    """Modules of the package that a file imports anywhere, functions included."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
    return found


MODULES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}
INSIDE = [name for name in MODULES if "." in name]


def test_folders_are_the_layers() -> None:
    folders = {path.name for path in PACKAGE.iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert folders == set(RANK)
    assert {path.name for path in PACKAGE.iterdir() if path.is_file()} == TOP_LEVEL


@pytest.mark.parametrize("module", INSIDE)
def test_imports_run_downward(module: str) -> None:
    own = module.split(".")[0]
    wrong = []
    for target in imports(MODULES[module]):
        if not target.startswith("friction_bayes."):
            continue
        folder = target.split(".")[1]
        if folder in RANK and folder != own and RANK[folder] >= RANK[own]:
            wrong.append(target)
    assert wrong == []


@pytest.mark.parametrize("module", [n for n in MODULES if n and n.split(".")[0] not in FACES])
def test_numerical_layers_name_no_sampler_and_no_plot(module: str) -> None:
    heavy = [name for name in imports(MODULES[module]) if name.split(".")[0] in HEAVY]
    assert heavy == []


def test_estimating_loads_no_sampler_and_no_plot() -> None:
    script = (
        "import sys, friction_bayes as fb\n"
        "system = fb.Oscillator(mass=10.0, stiffness=1000.0)\n"
        "record = fb.simulate(system, friction=0.5, initial_displacement=0.02, duration=5.0,"
        " sampling_rate=100.0, noise_sd=5e-4, seed=1)\n"
        "fb.estimate(record, system)\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_no_relative_imports_and_no_global_random_state() -> None:
    for path in MODULES.values():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, path
            if isinstance(node, ast.Attribute) and node.attr in {"seed", "set_state"}:
                assert ast.unparse(node) not in {"np.random.seed", "numpy.random.seed"}, path
