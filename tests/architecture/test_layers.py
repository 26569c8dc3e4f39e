"""Folders are the layers: imports run downward only, and every file lies in the room it belongs to.

Each rule is a function from a tree of modules to the faults it finds, and is shown a planted fault as
well as the package.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from parsed import nodes, parsed

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "friction_bayes"

# Lowest first. Folders of one layer do not import each other.
LAYERS: tuple[tuple[str, ...], ...] = (
    ("core",),
    ("records", "conjugate", "validation"),
    ("mechanics",),
    ("decay",),
    ("statespace",),
    ("estimators",),
    ("reference", "monitor"),
    ("loop",),
    ("plotting", "report"),
    ("app",),
    ("cli",),
)
RANK = {folder: rank for rank, layer in enumerate(LAYERS) for folder in layer}
TOP_LEVEL = {"__init__.py", "__main__.py", "testing.py", "py.typed"}
# Public or started from outside: they may import anything, and nobody need import them.
ABOVE = ("", "__main__", "testing")
# Folders next to the package that use it; each counts as one module.
SCRIPTS = ("experiments", "paper_figures", "benchmarks")

# What every folder may import, and the folders that may import what is not for everybody.
ANYWHERE = {"numpy", "scipy", "xarray"}
ROOMS: dict[str, set[str]] = {
    "argcomplete": {"cli"},
    "argparse": {"cli"},
    "arviz": {"reference"},
    "arviz_base": {"reference"},
    "arviz_stats": {"reference"},
    "asammdf": {"records"},
    "bokeh": {"app"},
    "dask": {"core", "monitor", "cli"},
    "emcee": {"reference"},
    "h5netcdf": {"cli"},
    "h5py": {"records"},
    "jinja2": {"report"},
    "matplotlib": {"plotting"},
    "nptdms": {"records"},
    "python_calamine": {"records"},
    "panel": {"app"},
    "numba": {"core", "mechanics", "decay", "statespace", "estimators", "monitor", "loop"},
    "pandas": {"records"},
    "pooch": {"records"},
    "pyuff": {"records"},
    "rich": {"cli"},
    "threadpoolctl": {"core"},
    "zarr": {"records"},
}

# Modules that one folder alone uses, and why they do not lie there.
AT_HOME = {
    "monitor.fleet_report": "what monitoring says of a fleet, computed below the command that shows it",
    "records.fleet": "records of a fleet",
    "records.force": "recorded next to a record",
    "report.loop": "a page",
    "report.monitor": "a page",
}


@dataclass(frozen=True)
class Module:
    """What the rules look at in a source file.

    ``imports`` holds modules of the tree by their dotted name below the package, "" for the package
    itself; ``outside`` holds the top-level names of everything else. Both hold what is imported inside
    functions, for type checking, or by name.
    """

    docstring: str
    imports: frozenset[str]
    outside: frozenset[str]

    @classmethod
    def parse(cls, name: str, source: str, tree: set[str]) -> Module:
        inside, outside = set(), set()
        for target in imported(source):
            top, _, below = target.partition(".")
            if top != "friction_bayes":
                outside.add(top)
            else:
                inside.add(below if below in tree else below.rpartition(".")[0])
        inside -= {name}
        return cls(ast.get_docstring(parsed(source)) or "", frozenset(inside), frozenset(outside))


def imported(source: str) -> Iterator[str]:
    """Dotted names that a file imports: modules, and names in modules."""
    for node in nodes(source):
        match node:
            case ast.ImportFrom(module=str(module), names=names):
                yield from (f"{module}.{alias.name}" for alias in names)
            case ast.Import(names=names):
                yield from (alias.name for alias in names)
            case ast.Call(
                func=ast.Name(id="import_module" | "optional_package" | "package_of_extra"),
                args=[ast.Constant(value=str(name)), *_],
            ):
                yield name


def read_tree(files: Mapping[str, str]) -> dict[str, Module]:
    """Modules by dotted name below the package, of sources by path below the package."""
    names = {}
    for path in files:
        parts = path.removesuffix(".py").split("/")
        names[path] = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
    tree = {"", *names.values()}
    return {name: Module.parse(name, files[path], tree) for path, name in names.items()}


def folder(module: str) -> str:
    return module.partition(".")[0]


def users(modules: Mapping[str, Module]) -> dict[str, set[str]]:
    """Who imports each module."""
    return {name: {user for user in modules if name in modules[user].imports} for name in modules}


def upward_imports(modules: Mapping[str, Module]) -> list[str]:
    faults = []
    for name, module in modules.items():
        own = folder(name)
        for target in sorted(module.imports):
            other = folder(target)
            if own not in RANK or other == own:
                continue
            # the package itself and its other top-level modules are above every layer but the last
            if RANK.get(other, RANK["cli"] - 0.5) >= RANK[own]:
                faults.append(f"{name} imports {target or 'friction_bayes'}")
    return faults


def strangers(modules: Mapping[str, Module]) -> list[str]:
    faults = []
    for name, module in modules.items():
        for package in sorted(module.outside):
            if name in SCRIPTS or (package in sys.stdlib_module_names and package not in ROOMS):
                continue
            if package not in ANYWHERE and folder(name) not in ROOMS.get(package, set()):
                faults.append(f"{name} imports {package}")
    return faults


def misplaced(modules: Mapping[str, Module]) -> list[str]:
    """Modules that one folder uses, which is not their own, though nothing they need keeps them out of it."""
    faults = []
    for name, by in users(modules).items():
        folders = {folder(user) for user in by}
        if "." not in name or len(folders) != 1 or folders <= {folder(name), *ABOVE}:
            continue
        (only,) = folders
        if only in SCRIPTS or all(
            only in rooms for package, rooms in ROOMS.items() if package in modules[name].outside
        ):
            faults.append(f"{name} is imported by {only} alone")
    return faults


def unused(modules: Mapping[str, Module]) -> list[str]:
    by = users(modules)
    # the import of any module of a package runs the package
    run = {name.rpartition(".")[0] for name in modules} | set(RANK) | {*ABOVE, *SCRIPTS}
    return [name for name in modules if not by[name] and name not in run]


def cycles(modules: Mapping[str, Module]) -> list[str]:
    """Import cycles between modules and between folders, sub-folders included, one of each at most."""
    by_folder: dict[str, set[str]] = {}
    for name, module in modules.items():
        own = by_folder.setdefault(place(name, modules), set())
        own |= {place(target, modules) for target in module.imports}
    between = {
        own: {other for other in others if not nested(own, other)} for own, others in by_folder.items()
    }
    graphs = [{name: module.imports for name, module in modules.items()}, between]
    found = []
    for graph in graphs:
        try:
            TopologicalSorter(graph).prepare()
        except CycleError as error:
            ring = error.args[1][:-1]
            first = ring.index(min(ring))
            found.append(" -> ".join((*ring[first:], *ring[:first], ring[first])))
    return found


def place(name: str, modules: Mapping[str, Module]) -> str:
    """The folder a module lies in; a package lies in its own."""
    is_package = any(other.startswith(f"{name}.") for other in modules)
    return name if is_package else name.rpartition(".")[0]


def nested(one: str, other: str) -> bool:
    return f"{one}.".startswith(f"{other}.") or f"{other}.".startswith(f"{one}.") or "" in (one, other)


def without_docstring(modules: Mapping[str, Module]) -> list[str]:
    """Modules without a docstring, and folders whose docstring is not one sentence."""
    faults = [name for name, module in modules.items() if not module.docstring]
    for name in RANK:
        docstring = modules[name].docstring if name in modules else ""
        if not re.fullmatch(r"(?!.*\. [A-Z]).*\.", docstring):
            faults.append(f"{name}: {docstring!r} is not one sentence")
    return faults


RULES = (upward_imports, strangers, unused, cycles, without_docstring)
FILES = {path.relative_to(PACKAGE).as_posix(): path.read_text() for path in sorted(PACKAGE.rglob("*.py"))}


@cache
def house() -> dict[str, Module]:
    """Modules of the package, and each folder next to it as one."""
    modules = read_tree(FILES)
    for scripts in SCRIPTS:
        together = "\n".join(path.read_text() for path in sorted((ROOT / scripts).rglob("*.py")))
        modules[scripts] = Module.parse(scripts, together, set(modules))
    return modules


def test_folders_are_the_layers() -> None:
    folders = {path.name for path in PACKAGE.iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert folders == set(RANK)
    assert {path.name for path in PACKAGE.iterdir() if path.is_file()} == TOP_LEVEL


@pytest.mark.parametrize("rule", RULES)
def test_every_file_lies_in_its_room(rule) -> None:
    assert rule(house()) == []


def test_modules_lie_where_they_are_used() -> None:
    found = {fault.partition(" ")[0]: fault for fault in misplaced(house())}
    assert [fault for name, fault in found.items() if name not in AT_HOME] == []
    assert set(AT_HOME) <= set(found), "an exception that is none any more"


TWO_MODULES = "core.text -> decay.phase -> core.text"

# A small house in order, in which every rule finds what is planted and nothing else.
SOUND = {f"{name}/__init__.py": f'"""What {name} is for."""' for name in RANK} | {
    "__init__.py": '"""The house."""\nfrom friction_bayes.estimators.fit import fit',
    "__main__.py": '"""Run."""\nfrom friction_bayes.cli.main import main',
    "cli/main.py": '"""Ask."""\nimport argparse, friction_bayes.decay.phase, friction_bayes.core.text',
    "core/text.py": '"""Words."""\nimport json\nimport numpy as np',
    "decay/phase.py": '"""Phase."""\nfrom numba import njit\nfrom friction_bayes.core.text import join',
    "estimators/fit.py": '"""Fit."""\nfrom friction_bayes.decay import phase',
}


@pytest.mark.parametrize(
    ("rule", "path", "source", "fault"),
    [
        (upward_imports, "core/a.py", "import friction_bayes.decay.phase", "core.a imports decay.phase"),
        (upward_imports, "core/a.py", "def f(): from friction_bayes.loop import x", "core.a imports loop"),
        (upward_imports, "core/a.py", "import_module('friction_bayes.cli.main')", "core.a imports cli.main"),
        (upward_imports, "report/a.py", "from friction_bayes import fit", "report.a imports friction_bayes"),
        (upward_imports, "records/a.py", "import friction_bayes.conjugate", "records.a imports conjugate"),
        (strangers, "estimators/fit.py", "import emcee.moves", "estimators.fit imports emcee"),
        (strangers, "conjugate/a.py", "from numba import njit", "conjugate.a imports numba"),
        (strangers, "decay/phase.py", "import argparse", "decay.phase imports argparse"),
        (strangers, "loop/a.py", "optional_package('nptdms', path)", "loop.a imports nptdms"),
        (strangers, "cli/main.py", "import pandas", "cli.main imports pandas"),
        (misplaced, "decay/phase.py", "import numba", "core.text is imported by cli alone"),
        (unused, "core/a.py", "", "core.a"),
        (cycles, "core/text.py", "import friction_bayes.decay.phase", TWO_MODULES),
        (without_docstring, "core/text.py", "import json", "core.text"),
        (without_docstring, "core/__init__.py", '"""One. Two."""', "core: 'One. Two.' is not one sentence"),
    ],
)
def test_each_rule_finds_a_planted_fault(rule, path, source, fault) -> None:
    assert rule(read_tree(SOUND)) == []
    assert fault in rule(read_tree(SOUND | {path: source}))


def test_a_module_stays_where_alone_it_may_import_what_it_needs() -> None:
    """``decay.phase`` is used by the command line alone, where numba has no place."""
    assert misplaced(read_tree(SOUND | {"estimators/fit.py": "import json"})) == []


def test_a_cycle_of_folders_is_found_where_no_module_is_in_one() -> None:
    crossed = {
        "estimators/peaks/a.py": "import friction_bayes.estimators.signal.a",
        "estimators/signal/a.py": "",
        "estimators/signal/b.py": "from friction_bayes.estimators.peaks.b import highest",
        "estimators/peaks/b.py": "highest = max",
    }
    assert cycles(read_tree(SOUND | crossed)) == ["estimators.peaks -> estimators.signal -> estimators.peaks"]


def test_contributing_has_each_folders_own_sentence() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| `(\w+)` \| (.*) \|$", text, re.MULTILINE)
    own = {name: house()[name].docstring.replace("``", "`") for name in RANK}
    assert rows == [(str(rank + 1), name, own[name]) for name, rank in RANK.items()]


def test_no_relative_imports_and_no_global_random_state() -> None:
    for path, source in FILES.items():
        for node in nodes(source):
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, path
            if isinstance(node, ast.Attribute) and node.attr in {"seed", "set_state"}:
                assert ast.unparse(node) not in {"np.random.seed", "numpy.random.seed"}, path
