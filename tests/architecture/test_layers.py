"""Imports run downward only, and the numerical layers never load a sampler or a plot."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "friction_bayes"

# Lowest layer first; an entry covers the module or package of that name.
LAYERS: tuple[tuple[str, ...], ...] = (
    ("words", "errors", "_checks", "quantities"),
    ("mechanics.oscillator",),
    ("record", "clipping", "readers", "writers", "datasets"),
    ("mechanics",),
    (
        "phase_polynomial",
        "phase_tracking",
        "demodulation",
        "moving_part",
        "free_decay",
        "halfcycle_kernels",
        "halfcycles",
        "likelihood",
        "signal_likelihood",
        "whiteness",
    ),
    ("conjugate", "scaled", "scaled_batch"),
    ("batch", "acceptance"),
    ("forces",),
    ("estimation",),
    ("diagnostics", "tabulated", "reference"),
    ("expected", "agreement", "checking", "calibration", "testing"),
    ("loop", "monitor"),
    ("output", "plotting", "report"),
    ("commands",),
    ("cli", "__main__"),
)
HEAVY = ("emcee", "arviz_base", "arviz_stats", "arviz_plots", "matplotlib")
FACES = ("reference", "plotting", "report", "commands", "cli", "__main__")


def module_name(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def layer_of(module: str) -> int:
    """Rank of the longest matching entry."""
    best, rank = -1, -1
    for level, names in enumerate(LAYERS):
        for name in names:
            if (module == name or module.startswith(f"{name}.")) and len(name) > best:
                best, rank = len(name), level
    return rank


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


def own_modules() -> dict[str, Path]:
    return {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}


MODULES = own_modules()


def test_every_module_has_a_layer() -> None:
    assert [name for name in MODULES if name and layer_of(name) < 0] == []
    assert [name for names in LAYERS for name in names if name not in MODULES] == []


@pytest.mark.parametrize("module", [name for name in MODULES if name])
def test_imports_run_downward(module: str) -> None:
    upward = []
    for target in imports(MODULES[module]):
        name = target.removeprefix("friction_bayes.")
        if target.startswith("friction_bayes.") and name in MODULES and layer_of(name) > layer_of(module):
            upward.append(name)
    assert upward == []


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


def test_files_stay_short() -> None:
    """A file may outgrow 300 lines only by being named here with its reason; none is."""
    long = {name: n for name, path in MODULES.items() if (n := len(path.read_text().splitlines())) > 300}
    assert long == {}


def test_no_relative_imports_and_no_global_random_state() -> None:
    for path in MODULES.values():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, path
            if isinstance(node, ast.Attribute) and node.attr in {"seed", "set_state"}:
                assert ast.unparse(node) not in {"np.random.seed", "numpy.random.seed"}, path
