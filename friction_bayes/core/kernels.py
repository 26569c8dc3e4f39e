"""How kernels are compiled: kept on disk, without the GIL, and with no more ways in than are used.

Around a function numba compiles a wrapper for Python and one for C, which took more of the compile time than
most kernels themselves; nothing here is called from C, and most kernels by other kernels alone.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import FunctionCache

__all__ = ["INLINED", "INNER", "INNER_OF_A_FUNCTION", "KERNEL", "njit"]

KERNEL: dict[str, Any] = {"cache": True, "nogil": True, "no_cfunc_wrapper": True, "error_model": "numpy"}
"""Options of a kernel that Python calls.

A division by zero is infinite or nan, as in NumPy: a check of every division for a zero takes a twelfth of
the compile time and keeps loops from being vectorised.
"""

INNER: dict[str, Any] = {**KERNEL, "no_cpython_wrapper": True}
"""Options of a kernel that other kernels alone call; a call from Python would end the process.

``tests/architecture/test_kernels.py`` fails on any.
"""

INNER_OF_A_FUNCTION: dict[str, Any] = {**INNER, "cache": False}
"""The same of a kernel that takes a function: numba keeps on disk only what calls it."""

INLINED: dict[str, Any] = {**INNER, "inline": "always"}
"""The same of a kernel with one caller: numba links a kernel into what calls it, and optimises it anew."""


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile as numba does, and keep the result on disk until any kernel of the package changes.

    numba alone keeps it until the file that it stands in does, though kernels and forces of other files are
    compiled into it.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(**options)(function)
        if options.get("cache"):
            kernel._cache = _Cache(function)
        return kernel

    return compiled


class _Cache(FunctionCache):
    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        # an index of another stamp counts as empty, and its files are written over
        self._cache_file._source_stamp = self._impl.locator.get_source_stamp(), _digest_of_kernels()


@cache
def _digest_of_kernels() -> str:
    """Digest of the modules with compiled code and of what they import, whose constants are part of it."""
    package = Path(__file__).parents[1]
    sources = {
        ".".join(path.relative_to(package).with_suffix("").parts).encode(): path.read_bytes()
        for path in sorted(package.rglob("*.py"))
    }
    kernels = {name for name, source in sources.items() if b"njit" in source}
    text = b"".join(sources[name] for name in kernels)
    imported = set(re.findall(rb"^from friction_bayes\.(\S+) import", text, re.MULTILINE))
    read = sorted((kernels | imported) & sources.keys())
    return hashlib.sha256(b"".join(sources[name] for name in read)).hexdigest()
