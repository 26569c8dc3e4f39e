"""Two things of the package never share a public name."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from parsed import parsed

PACKAGE = Path(__file__).parents[2] / "friction_bayes"

# what a command has, and how each registry is filled
PROTOCOL = {"add_parser", "run", "register"}
# the same parameter, at its place in the coefficients of each method
PARAMETERS = {"FRICTION", "OFFSET", "VELOCITY"}


def public_names(source: str) -> Iterator[str]:
    """Functions, classes and values that a module defines at its top and does not keep to itself."""
    for node in parsed(source).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for target in targets:
                yield from (name.id for name in ast.walk(target) if isinstance(name, ast.Name))


def test_no_two_modules_define_one_public_name() -> None:
    homes: defaultdict[str, set[str]] = defaultdict(set)
    for path in sorted(PACKAGE.rglob("*.py")):
        for name in public_names(path.read_text(encoding="utf-8")):
            if not name.startswith("_") and name not in PROTOCOL | PARAMETERS:
                homes[name].add(path.relative_to(PACKAGE).as_posix())
    assert len(homes) > 100
    assert {name: sorted(where) for name, where in homes.items() if len(where) > 1} == {}


def test_names_are_found() -> None:
    source = "A, B = 1, 2\nC: int = 3\ndef f(): D = 1\nclass G: H = 2"
    assert list(public_names(source)) == ["A", "B", "C", "f", "G"]
