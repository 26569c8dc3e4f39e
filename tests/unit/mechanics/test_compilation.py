"""Compiling is announced: once, where a kernel is compiled, and not where none is."""

from __future__ import annotations

import gc

import pytest
from numba import njit
from numba.core.errors import TypingError

from friction_bayes.mechanics.compilation import compilation_announced


def test_compiling_is_announced_once() -> None:
    double, triple = njit(lambda x: 2 * x), njit(lambda x: 3 * x)
    announced: list[str] = []
    with compilation_announced(lambda: announced.append("compiling")):
        assert announced == []
        double(1)
        triple(1)
        assert announced == ["compiling"]
    with compilation_announced(lambda: announced.append("again")):
        double(2)
    triple(1.5)
    assert announced == ["compiling"]


def test_dead_objects_are_not_searched_for_while_a_kernel_is_compiled() -> None:
    searched: list[bool] = []
    inner = njit(lambda x: 2 * x)
    outer = njit(lambda x: inner(x) + missing)  # type: ignore[name-defined]  # noqa: F821
    with compilation_announced(lambda: None):
        gc.callbacks.append(lambda phase, info: searched.append(True))
        try:
            with pytest.raises(TypingError):
                outer(1)
        finally:
            gc.callbacks.pop()
        assert gc.isenabled()
    assert searched == []
