"""How kernels are compiled: kept on disk, without the GIL, and with no more ways in than are used.

Around a function numba compiles a wrapper for Python and one for C, which took more of the compile time than
most kernels themselves; nothing here is called from C, and most kernels by other kernels alone.
"""

from __future__ import annotations

from typing import Any

__all__ = ["INLINED", "INNER", "INNER_OF_A_FUNCTION", "KERNEL"]

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
