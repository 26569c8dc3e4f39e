"""The sources that the numbers of an experiment are made of, and the digest that changes with them."""

from __future__ import annotations

import ast
import hashlib
import json
import subprocess
from functools import cache
from pathlib import Path

import xarray as xr

__all__ = ["ARCHIVE", "ROOT", "commit", "sources_digest", "sources_of", "stored_result", "why_not_usable"]

ROOT = Path(__file__).parents[1]
"""Folder of the package and of the experiments."""
ARCHIVE = ROOT / "archive"
"""Results that are kept in the repository, each for the commit that its manifest names."""


def sources_of(name: str, root: Path = ROOT) -> list[Path]:
    """Return the files that the numbers of an experiment depend on.

    They are the whole package; of the experiments the module of that name and all that it imports, directly
    or not; and the table (``.toml``) next to any of these.

    Parameters
    ----------
    name : str
        Of the experiment.
    root : Path
        Folder of the package and of the experiments.
    """
    package = root / "friction_bayes"
    found = {path for end in ("py", "toml") for path in package.rglob(f"*.{end}")}
    waiting = [f"experiments.{name}"]
    seen = set()
    while waiting:
        module = waiting.pop()
        path = root.joinpath(*module.split(".")).with_suffix(".py")
        if module in seen or not path.is_file():
            # the second is a name in a module, or a folder
            continue
        seen.add(module)
        found |= {each for each in (path, path.with_suffix(".toml")) if each.is_file()}
        waiting += _imported(path.read_text(encoding="utf-8"))
    return sorted(found)


@cache
def _imported(source: str) -> tuple[str, ...]:
    """Names that may be modules of the experiments, in functions too; parsed once for all experiments."""
    names: list[str] = []
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Import(names=aliases):
                names += (alias.name for alias in aliases if alias.name.startswith("experiments."))
            case ast.ImportFrom(module=str(module), names=aliases) if (
                module.partition(".")[0] == "experiments"
            ):
                names += (module, *(f"{module}.{alias.name}" for alias in aliases))
    return tuple(names)


def sources_digest(name: str, root: Path = ROOT) -> str:
    """Return the sha256 digest of :func:`sources_of`, names and contents.

    Parameters
    ----------
    name, root
        As there.
    """
    digest = hashlib.sha256()
    for path in sources_of(name, root):
        digest.update(f"{path.relative_to(root).as_posix()}\n".encode())
        digest.update(_digest_of(path, path.stat().st_mtime_ns))
    return digest.hexdigest()


@cache
def _digest_of(path: Path, changed_ns: int) -> bytes:
    """Digest of a file's contents, read once for all experiments for as long as it does not change."""
    return hashlib.sha256(path.read_bytes()).digest()


def commit(root: Path = ROOT) -> str | None:
    """Return the commit of the sources, with ``-dirty`` where files differ from it; None outside of Git."""
    command = ["git", "-C", str(root), "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def stored_result(name: str, results: Path) -> xr.Dataset:
    """Return the dataset of an experiment, read once for all pages for as long as it does not change.

    Parameters
    ----------
    name : str
        Of the experiment.
    results : Path
        Folder with ``NAME.nc``.
    """
    path = results / f"{name}.nc"
    return _read(path, path.stat().st_mtime_ns).copy()


@cache
def _read(path: Path, changed_ns: int) -> xr.Dataset:
    return xr.load_dataset(path, engine="h5netcdf")


def why_not_usable(name: str, results: Path) -> str | None:
    """Return why the result of an experiment cannot be used with these sources; None if it can.

    One of :data:`ARCHIVE` is used whatever the sources: it names the commit that computed it.

    Parameters
    ----------
    name : str
        Of the experiment.
    results : Path
        Folder with ``NAME.nc`` and its manifest ``NAME.json``.
    """
    stored, record = results / f"{name}.nc", results / f"{name}.json"
    if not stored.exists() or not record.exists():
        return f"no {stored}; run python -m experiments {name} first"
    if results.resolve() == ARCHIVE:
        return None
    if json.loads(record.read_text(encoding="utf-8")).get("sources") != sources_digest(name):
        return f"{stored} was computed by other sources than these; run python -m experiments {name} again"
    return None
