"""Compiling is announced: once, where a kernel is compiled, and not where none is."""

from __future__ import annotations

from numba import njit

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
