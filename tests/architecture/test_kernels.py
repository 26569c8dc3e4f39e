"""Kernels without a way in for Python, where a call would end the process, are those of kernels alone."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from parsed import parsed

ROOT = Path(__file__).parents[2]
FOLDERS = ("friction_bayes", "experiments", "paper_figures", "benchmarks", "tests")
WITHOUT_WRAPPER = {"INNER", "INNER_OF_A_FUNCTION", "INLINED"}


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


@cache
def trees() -> dict[str, ast.Module]:
    """Every module of the repository."""
    return {
        module_name(path): parsed(path.read_text(encoding="utf-8"))
        for folder in FOLDERS
        for path in sorted((ROOT / folder).rglob("*.py"))
    }


def options(function: ast.FunctionDef) -> set[str]:
    """Names in its decorators: of what compiles it, and of the options."""
    return {
        node.id
        for decorator in function.decorator_list
        for node in ast.walk(decorator)
        if isinstance(node, ast.Name)
    }


def inner_kernels(module: str, tree: ast.Module, wanted: set[str]) -> set[str]:
    """Full names of those that have one of the options; those made in functions have no name to call."""
    return {
        f"{module}.{node.name}"
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and options(node) & wanted
    }


def imported(module: str, tree: ast.Module) -> dict[str, str]:
    """Full name of what each name of a module may refer to."""
    names = {node.name: f"{module}.{node.name}" for node in tree.body if isinstance(node, ast.FunctionDef)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            names |= {each.asname or each.name: f"{node.module}.{each.name}" for each in node.names}
        elif isinstance(node, ast.Import):
            names |= {each.asname: each.name for each in node.names if each.asname}
    return names


def uses(module: str, tree: ast.Module, kernels: frozenset[str]) -> Iterator[tuple[str, bool]]:
    """Each use of a kernel, and whether it is in compiled code; its source, ``py_func``, is none."""
    names, last = imported(module, tree), {kernel.rpartition(".")[2] for kernel in kernels}

    def within(node: ast.AST, compiled: bool) -> Iterator[tuple[str, bool]]:
        if isinstance(node, ast.Attribute) and node.attr == "py_func":
            return
        if isinstance(node, ast.FunctionDef):
            compiled = compiled or bool(options(node) & {"njit", "register_jitable"})
        full = ""
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            full = names.get(node.id, "")
        elif isinstance(node, ast.Attribute) and node.attr in last:
            full = f"{names.get(ast.unparse(node.value), ast.unparse(node.value))}.{node.attr}"
        if full in kernels:
            yield full, compiled
        for child in ast.iter_child_nodes(node):
            yield from within(child, compiled)

    yield from within(tree, False)


@cache
def all_kernels(*wanted: str) -> frozenset[str]:
    """Full names of the kernels of the repository that have one of some options."""
    found = (inner_kernels(module, tree, set(wanted)) for module, tree in trees().items())
    kernels = frozenset().union(*found)
    assert len(kernels) > 3
    return kernels


@cache
def all_uses() -> tuple[tuple[str, str, bool], ...]:
    """Kernel, module that uses it, and whether in compiled code, over the repository."""
    kernels = all_kernels("KERNEL", *WITHOUT_WRAPPER)
    return tuple(
        (kernel, module, compiled)
        for module, tree in trees().items()
        for kernel, compiled in uses(module, tree, kernels)
    )


def test_uses_are_found() -> None:
    source = (
        "from a import f\nfrom b import c as d\nimport b.c\n\n@njit(**INNER)\ndef g(x):\n    return f(x)\n\n"
        "def h(x):\n    return f(x) + d.k(x) + b.c.k(x) + g(x) + g.py_func(x)\n"
    )
    tree = parsed(source)
    assert inner_kernels("m", tree, {"INNER"}) == {"m.g"}
    assert list(uses("m", tree, frozenset({"m.g", "a.f", "b.c.k"}))) == [
        ("a.f", True),
        ("a.f", False),
        ("b.c.k", False),
        ("b.c.k", False),
        ("m.g", False),
    ]


def test_inner_kernels_are_called_by_kernels_alone() -> None:
    inner = all_kernels(*WITHOUT_WRAPPER)
    assert [use for use in all_uses() if use[0] in inner and not use[2]] == []


def test_kernels_that_kernels_alone_call_have_no_way_in_for_python() -> None:
    """The wrapper takes longer to compile than most of them."""
    called = {kernel for kernel, _, compiled in all_uses() if not compiled}
    assert all_kernels("KERNEL") - called == set()


def test_what_is_written_into_its_caller_has_one() -> None:
    called = [kernel for kernel, _, _ in all_uses() if kernel in all_kernels("INLINED")]
    assert len(called) == len(set(called))
