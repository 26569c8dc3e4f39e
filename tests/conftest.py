"""One seed for every test, one thread of BLAS, and the environment that numba and matplotlib must find."""

from __future__ import annotations

import gc
import os
import zlib
from pathlib import Path

import pytest

_ROOT = Path(__file__).resolve().parents[1]


os.environ.setdefault("NUMBA_CACHE_DIR", str(_ROOT / ".cache" / "numba"))
os.environ["MPLBACKEND"] = "Agg"

import hypothesis  # noqa: E402  (after the environment is set)
import numpy as np  # noqa: E402

from blas_threads import set_blas_threads  # noqa: E402
from friction_bayes.testing import base_seed  # noqa: E402

# an example that compiles a kernel, or shares its core, takes longer than the others
hypothesis.settings.register_profile("suite", deadline=None)
hypothesis.settings.load_profile("suite")

# they spin, and those of the workers of a parallel run fight for the cores
set_blas_threads(1)


def pytest_sessionstart() -> None:
    """Share the compilation of the kernels among the workers of a parallel run."""
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker is not None and os.environ["PYTEST_XDIST_WORKER_COUNT"] != "1":
        # a run in one process need not load what this loads
        from first_use import use_kernels

        # until the tests are collected nothing is searched for dead objects: a fourteenth of the compiling
        gc.disable()
        use_kernels(int(worker.removeprefix("gw")), os.environ["PYTEST_XDIST_TESTRUNUID"])


def pytest_collection_finish() -> None:
    """Keep what collecting loaded out of every later search for dead objects: a tenth of a test's time."""
    gc.freeze()
    gc.enable()
    # as often as usual the search takes a twentieth, most of it among what the tests load and keep
    gc.set_threshold(10_000)


@pytest.fixture
def seed(request: pytest.FixtureRequest) -> int:
    """A seed of this test's own, derived from the one base seed and the kind, file and name of the test."""
    path = request.node.path
    kind = path.relative_to(_ROOT / "tests").parts[0]
    own = zlib.crc32(f"tests/{kind}/{path.name}::{request.node.name}".encode())
    return int(np.random.SeedSequence([base_seed(), own]).generate_state(1)[0])


@pytest.fixture
def rng(seed: int) -> np.random.Generator:
    """A generator of this test's own; the order in which tests run does not matter."""
    return np.random.default_rng(seed)
