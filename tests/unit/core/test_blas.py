"""BLAS is held to one thread within calls of the package, and left as it was found after them."""

from __future__ import annotations

import os
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import friction_bayes as fb
from blas_threads import blas_threads, set_blas_threads
from decays import SYSTEM, long_decay, short_decay
from experiments.runner import _run_cell
from friction_bayes.core.blas import single_threaded_blas
from friction_bayes.monitor.points import DetectionPoints
from friction_bayes.monitor.report import follow
from friction_bayes.reference import sample_target

FOUND = 2


@contextmanager
def own_thread() -> Iterator[Callable[[Callable[[], object]], object]]:
    """A thread that lives on between what it is given to do."""
    with ThreadPoolExecutor(1) as thread:
        yield lambda work: thread.submit(work).result(timeout=60.0)


@pytest.fixture(autouse=True)
def _two_threads() -> Iterator[None]:
    assert blas_threads() == {1}, "the suite runs with one"
    set_blas_threads(FOUND)
    assert blas_threads() == {FOUND}
    yield
    assert blas_threads() == {FOUND}
    set_blas_threads(1)


def test_calls_may_be_nested() -> None:
    with single_threaded_blas():
        with single_threaded_blas():
            assert blas_threads() == {1}
        assert blas_threads() == {1}


def test_an_exception_leaves_no_limit_behind() -> None:
    with pytest.raises(ZeroDivisionError), single_threaded_blas():
        raise ZeroDivisionError
    assert blas_threads() == {FOUND}


@pytest.mark.parametrize("first_to_leave", [0, 1])
@pytest.mark.parametrize("first_is_main", [False, True])
def test_the_last_of_several_threads_lifts_the_limit(first_to_leave: int, first_is_main: bool) -> None:
    with ExitStack() as stack:
        threads = [stack.enter_context(own_thread()) for _ in range(2)]
        if first_is_main:
            threads[0] = lambda work: work()
        held: list[AbstractContextManager[None]] = [single_threaded_blas() for _ in threads]
        for each, context in zip(threads, held, strict=True):
            each(context.__enter__)
            assert blas_threads() == {1}
        for k in (first_to_leave, 1 - first_to_leave):
            assert blas_threads() == {1}
            threads[k](lambda k=k: held[k].__exit__(None, None, None))
        assert blas_threads() == {FOUND}


def test_many_threads_never_see_more_than_one() -> None:
    def work(seed: int) -> set[int]:
        rng = np.random.default_rng(seed)
        seen = set()
        for pause in rng.uniform(0.0, 1e-3, 40).tolist():
            with single_threaded_blas():
                time.sleep(pause)
                seen |= blas_threads()
        return seen

    with ThreadPoolExecutor(4) as pool:
        assert set.union(*pool.map(work, range(4))) == {1}
    assert blas_threads() == {FOUND}


class Reached(Exception):
    """Raised where an entry point has come to its work, which need not be done here."""


POINTS = DetectionPoints(
    times=np.arange(3.0),
    time_unit="h",
    friction=np.array([1.0, 1.1, 1.2]),
    sd=np.full(3, 0.01),
    unit="N",
    relative_sd=0.0,
)
ENTRIES: dict[str, tuple[str, str, Callable[[], object]]] = {
    "estimate": (
        "friction_bayes.estimators.estimate",
        "find_free_decay",
        lambda: fb.estimate(short_decay(), SYSTEM),
    ),
    "estimate_batch": (
        "friction_bayes.estimators.batch",
        "_estimate_chunk",
        lambda: fb.estimate_batch(short_decay().expand_dims("machine"), SYSTEM),
    ),
    "close_loop": (
        "friction_bayes.loop.pipeline",
        "cut_records",
        lambda: fb.close_loop([short_decay()], SYSTEM, seed=1),
    ),
    "sample_target": (
        "friction_bayes.reference.sampling",
        "Ensembles",
        lambda: sample_target(SimpleNamespace(), seed=1),
    ),
    "follow": ("friction_bayes.monitor.report", "fit_laws", lambda: follow(POINTS, None)),
    "a cell of an experiment": (
        "experiments.runner",
        "_cell_seed",
        lambda: _run_cell(({}, Path()), experiment=SimpleNamespace(run=None, config=None), seed=1),
    ),
}


@pytest.mark.parametrize("entry", ENTRIES)
def test_entry_points_work_with_one_thread(entry: str, monkeypatch: pytest.MonkeyPatch) -> None:
    module, inner, call = ENTRIES[entry]
    seen = []

    def reach(*_: object, **__: object) -> None:
        seen.append(blas_threads())
        raise Reached

    monkeypatch.setattr(import_module(module), inner, reach)
    with pytest.raises(Reached):
        call()
    assert seen == [{1}]


def test_warnings_name_the_line_of_the_caller() -> None:
    record = long_decay(seed=1)
    record[200] += 1.0
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = fb.estimate(record, SYSTEM, random_force="none")
        sample_target(found.fit.target, seed=1, max_steps=150, ess=1e9)
    assert [each.category for each in caught] == [fb.RecordWarning, fb.NotConvergedWarning]
    assert {each.filename for each in caught} == {__file__}


def test_the_program_loads_the_blas_of_scipy_with_one_thread() -> None:
    script = (
        "import sys\n"
        "from friction_bayes.cli.program import command\n"
        "sys.argv = ['friction-bayes', 'simulate']\n"
        "status = command()\n"
        "from threadpoolctl import threadpool_info\n"
        "before = {each['filepath'] for each in threadpool_info()}\n"
        "import scipy.linalg\n"
        "own = {each['num_threads'] for each in threadpool_info() if each['filepath'] not in before}\n"
        "print(status, own <= {1})"
    )
    environment = {name: value for name, value in os.environ.items() if "NUM_THREADS" not in name}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment)
    assert done.stdout.split() == ["2", "True"], done.stderr
