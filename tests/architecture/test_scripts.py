"""Folders next to the package: experiments feed figures and benchmarks, and take nothing back."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from parsed import nodes

ROOT = Path(__file__).parents[2]

# what each folder may import of the others
MAY_IMPORT = {
    "friction_bayes": set(),
    "experiments": {"friction_bayes"},
    "paper_figures": {"friction_bayes", "experiments"},
    "benchmarks": {"friction_bayes", "experiments"},
}


def imported_folders(source: str) -> set[str]:
    names = set()
    for node in nodes(source):
        if isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
        elif isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
    return {name.partition(".")[0] for name in names}


@pytest.mark.parametrize("folder", MAY_IMPORT)
def test_scripts_import_in_one_direction(folder):
    forbidden = {*MAY_IMPORT, "tests"} - MAY_IMPORT[folder] - {folder}
    wrong = {
        path.relative_to(ROOT).as_posix(): found
        for path in sorted((ROOT / folder).rglob("*.py"))
        if (found := imported_folders(path.read_text()) & forbidden)
    }
    assert wrong == {}


def test_a_planted_import_is_seen():
    assert imported_folders("from benchmarks.accuracy import measure\nimport tests.unit") >= {
        "benchmarks",
        "tests",
    }
