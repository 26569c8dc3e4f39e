"""Output folders appear whole or not at all; JSON is strict."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from friction_bayes.core.errors import InputError
from friction_bayes.core.files import manifest, output_folder, sha256_of, write_manifest, write_whole
from friction_bayes.core.strict_json import strict_json


def test_json_is_strict() -> None:
    value = {
        "a": np.float64("nan"),
        "b": [np.inf, 1.0],
        "c": np.arange(2),
        4: Path("x"),
        "d": np.True_,
        "e": (None,),
    }
    assert json.loads(strict_json(value)) == {
        "a": None,
        "b": [None, 1.0],
        "c": [0, 1],
        "4": "x",
        "d": True,
        "e": [None],
    }


def test_digest_of_a_file_and_a_folder(tmp_path: Path) -> None:
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "a").write_bytes(b"abc")
    # FIPS 180-2, example B.1
    known = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert sha256_of(tmp_path / "store" / "a") == known
    before = sha256_of(tmp_path / "store")
    (tmp_path / "store" / "a").rename(tmp_path / "store" / "b")
    assert sha256_of(tmp_path / "store") != before


def test_folder_appears_at_the_end(tmp_path: Path) -> None:
    target = tmp_path / "a" / "b"
    with output_folder(target) as folder:
        (folder / "x").write_text("1")
        assert not target.exists()
    assert (target / "x").read_text() == "1"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_nothing_remains_of_a_failure(tmp_path: Path) -> None:
    def fail() -> None:
        with output_folder(tmp_path / "a") as folder:
            (folder / "x").write_text("1")
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_empty_folder_is_free_to_use(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    with output_folder(tmp_path / "a") as folder:
        (folder / "x").write_text("1")
    assert (tmp_path / "a" / "x").exists()


def test_force_replaces_own_files_only(tmp_path: Path) -> None:
    target = tmp_path / "a"
    for name in ("first", "second"):
        with output_folder(target, force=name == "second") as folder:
            (folder / name).write_text("1")
            write_manifest(folder, manifest("test", options={}, seed=None))
        (target / "mine").write_text("keep")
    assert sorted(path.name for path in target.iterdir()) == ["manifest.json", "mine", "second"]


def test_forged_manifest_removes_nothing_outside(tmp_path: Path) -> None:
    target = tmp_path / "a"
    target.mkdir()
    (tmp_path / "precious").write_text("keep")
    (target / "manifest.json").write_text(json.dumps({"files": ["../precious"]}))
    with output_folder(target, force=True) as folder:
        (folder / "x").write_text("1")
    assert (tmp_path / "precious").read_text() == "keep"


def test_filled_folder_needs_force(tmp_path: Path) -> None:
    (tmp_path / "x").write_text("1")
    with pytest.raises(InputError, match="add force"), output_folder(tmp_path):
        raise AssertionError("entered")


def test_a_file_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    def fail(path: Path) -> None:
        path.write_text("half", encoding="utf-8")
        raise RuntimeError

    target = tmp_path / "result.json"
    target.write_text("earlier", encoding="utf-8")
    with pytest.raises(RuntimeError):
        write_whole(target, fail)
    assert target.read_text(encoding="utf-8") == "earlier"
    write_whole(target, lambda path: path.write_text("whole", encoding="utf-8"))
    assert target.read_text(encoding="utf-8") == "whole"
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_that_cannot_be_written_is_refused_by_its_name(tmp_path: Path) -> None:
    target = tmp_path / "missing" / "result.json"
    with pytest.raises(InputError, match=r"result\.json: cannot be written \(No such file"):
        write_whole(target, lambda path: path.write_text("whole", encoding="utf-8"))
    assert list(tmp_path.iterdir()) == []
