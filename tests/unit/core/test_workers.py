"""Work that is spread over processes of this machine; over a scheduler's see ``test_cluster.py``."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from friction_bayes.core.workers import for_each


def test_processes_of_this_machine_do_each_item_once(tmp_path: Path) -> None:
    def leave(place: Path) -> None:
        with place.open("x") as file:
            file.write(str(os.getpid()))

    places, done = [tmp_path / str(k) for k in range(5)], []
    for_each(leave, places, scheduler=None, workers=2, done=lambda: done.append(1))
    assert len(done) == len(places)
    assert str(os.getpid()) not in {place.read_text() for place in places}


def test_one_process_is_this_one(tmp_path: Path) -> None:
    found: list[int] = []
    for_each(lambda _: found.append(os.getpid()), [1, 2], scheduler=None, workers=1, done=lambda: None)
    assert found == [os.getpid()] * 2
    with pytest.raises(ZeroDivisionError):
        for_each(lambda each: 1 // each, [0], scheduler=None, workers=8, done=lambda: None)
