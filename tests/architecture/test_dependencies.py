"""Every package that is imported is declared, and every declared one is imported."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

from parsed import nodes

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def named(requirements: list[str]) -> set[str]:
    """Import names of requirements such as ``arviz-stats[xarray]>=0.8``."""
    names = {re.split(r"[\[<>=;! ]", requirement, maxsplit=1)[0] for requirement in requirements}
    return {name.lower().replace("-", "_") for name in names}


def imported(*folders: str) -> set[str]:
    """Top-level packages that the modules of some folders import, inside functions too."""
    found = set()
    for folder in folders:
        for path in (ROOT / folder).rglob("*.py"):
            for node in nodes(path.read_text()):
                match node:
                    case ast.Import(names=aliases):
                        found |= {alias.name.partition(".")[0] for alias in aliases}
                    case ast.ImportFrom(module=str(module)):
                        found.add(module.partition(".")[0])
                    case ast.Call(
                        func=ast.Name(id="optional_package" | "package_of_extra"),
                        args=[ast.Constant(value=str(name)), *_],
                    ):
                        found.add(name.partition(".")[0])
    return found - set(sys.stdlib_module_names) - {"friction_bayes", "experiments", "paper_figures"}


@pytest.mark.parametrize(
    ("folders", "extras"),
    [
        (("friction_bayes",), ("app", "arviz", "formats")),
        (("friction_bayes", "experiments", "paper_figures"), ("app", "arviz", "formats", "experiments")),
    ],
    ids=["package", "experiments"],
)
def test_imported_is_declared_and_declared_is_imported(
    folders: tuple[str, ...], extras: tuple[str, ...]
) -> None:
    declared = named(PROJECT["dependencies"])
    for extra in extras:
        declared |= named(PROJECT["optional-dependencies"][extra])
    assert imported(*folders) == declared
