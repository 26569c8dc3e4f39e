"""Sources parsed once a process, for the tests that read them."""

from __future__ import annotations

import ast
from functools import cache

__all__ = ["nodes", "parsed"]


@cache
def parsed(source: str) -> ast.Module:
    """Parse a source, which callers share and must not change."""
    return ast.parse(source)


@cache
def nodes(source: str) -> tuple[ast.AST, ...]:
    """Every node of a source."""
    return tuple(ast.walk(parsed(source)))
