"""Functions of the estimation are short and take few parameters."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from parsed import nodes

PACKAGE = Path(__file__).parents[2] / "friction_bayes"
FOLDERS = ("statespace", "estimators", "loop")
MOST_LINES = 60
"""Without the docstring."""
MOST_PARAMETERS = 8

# what users call, whose parameters are options
OF_USERS = {"estimate", "estimate_batch", "close_loop"}


def functions(source: str) -> Iterator[tuple[str, int, int]]:
    """Name, lines without the docstring, and parameters of every function."""
    for node in nodes(source):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = node.end_lineno - node.lineno + 1
            if ast.get_docstring(node) is not None:
                lines -= node.body[0].end_lineno - node.body[0].lineno + 1
            given = node.args
            named = len(given.posonlyargs) + len(given.args) + len(given.kwonlyargs)
            yield node.name, lines, named + sum(each is not None for each in (given.vararg, given.kwarg))


@pytest.mark.parametrize("folder", FOLDERS)
def test_functions_are_short_and_take_few_parameters(folder: str) -> None:
    found = [
        (path.relative_to(PACKAGE).as_posix(), *function)
        for path in sorted((PACKAGE / folder).rglob("*.py"))
        for function in functions(path.read_text(encoding="utf-8"))
    ]
    assert found
    assert [each for each in found if each[2] > MOST_LINES] == []
    assert [each for each in found if each[3] > MOST_PARAMETERS and each[1] not in OF_USERS] == []


def test_lines_and_parameters_are_counted() -> None:
    source = 'def f(a, /, b, *c, d, **e):\n    """Say\n    it."""\n    return a'
    assert list(functions(source)) == [("f", 2, 5)]
