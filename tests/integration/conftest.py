"""Free decays written out by hand, independent of the package's own simulation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from decays import written_decay
from friction_bayes.core.arrays import Array

Signal = tuple[Array, Array]


@pytest.fixture
def decay(rng: np.random.Generator) -> Callable[..., Signal]:
    """Time [s] and displacement [m] of a decay from rest: m = 10 kg, k = 1000 N/m, r = 0.5 N."""

    def make(
        *, amplitude: float = 0.02, duration: float = 5.0, noise_sd: float = 1e-4, rate: float = 100.0
    ) -> Signal:
        time = np.arange(round(duration * rate)) / rate
        return time, written_decay(time, amplitude, 5e-4) + rng.normal(0.0, noise_sd, time.size)

    return make


@pytest.fixture
def write_csv(tmp_path: Path) -> Callable[..., Path]:
    """Write a record to a CSV file of the given name."""

    def write(name: str, time: Array, signal: Array, column: str) -> Path:
        path = tmp_path / name
        rows = "\n".join(f"{t:.9g},{x:.9g}" for t, x in zip(time, signal, strict=True))
        path.write_text(f"time_s,{column}\n{rows}\n")
        return path

    return write


@pytest.fixture
def csv(decay: Callable[..., Signal], write_csv: Callable[..., Path]) -> Path:
    """A good record, decay.csv."""
    return write_csv("decay.csv", *decay(), "displacement_m")


@pytest.fixture
def without_loop_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    """Closing the loop leaves no folder: its contents have tests of their own."""
    monkeypatch.setattr("friction_bayes.cli.loop_folder.write_loop", lambda *_: None)


@pytest.fixture
def without_loop_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures of the loop are empty: they are drawn, and looked at, elsewhere."""
    monkeypatch.setattr(
        "friction_bayes.cli.loop_folder.figure_files", lambda _, kinds: dict.fromkeys(kinds, b"")
    )


@pytest.fixture
def without_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures of other commands are empty: they are drawn, and looked at, elsewhere."""
    monkeypatch.setattr(
        "friction_bayes.plotting.write_figures", lambda figures, *_: dict.fromkeys(figures, b"")
    )


@pytest.fixture
def empty_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are made, and their files written, but nothing is drawn into these."""
    monkeypatch.setattr(
        "friction_bayes.plotting.style.figure_files", lambda _, formats: dict.fromkeys(formats, b"")
    )
