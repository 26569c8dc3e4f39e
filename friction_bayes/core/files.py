"""What commands leave behind: folders and files that appear whole or not at all, strict JSON, a manifest."""

from __future__ import annotations

import hashlib
import json
import platform
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from friction_bayes.core.errors import InputError
from friction_bayes.core.strict_json import strict_json

__all__ = [
    "cannot_be_written",
    "check_file_target",
    "check_folder_target",
    "listing_digest",
    "manifest",
    "nearest_existing",
    "output_folder",
    "settings_key",
    "sha256_of",
    "versions",
    "write_json",
    "write_manifest",
    "write_whole",
]

MANIFEST_NAME = "manifest.json"
_VERSIONED = ("numpy", "scipy", "numba", "xarray", "emcee", "arviz-base", "arviz-stats", "matplotlib")


def write_json(path: Path, value: Mapping[str, Any] | Sequence[Any]) -> None:
    """Write ``value`` as strict JSON, with a newline at the end."""
    path.write_text(strict_json(value) + "\n", encoding="utf-8")


def write_whole(target: Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` make a file aside, then rename it: ``target`` appears whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    try:
        with _aside(target) as folder:
            written = folder / target.name
            write(written)
            written.replace(target)
    except OSError as error:
        raise cannot_be_written(str(target), error) from None


def sha256_of(path: Path) -> str:
    """Digest of a file, or of all files below a folder together with their names (a Zarr store)."""
    digest = hashlib.sha256()
    if path.is_dir():
        for part in sorted(p for p in path.rglob("*") if p.is_file()):
            digest.update(part.relative_to(path).as_posix().encode())
            digest.update(bytes.fromhex(sha256_of(part)))
        return digest.hexdigest()
    with path.open("rb") as stream:
        while block := stream.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def listing_digest(folder: Path) -> str:
    """Digest of the names, sizes and times of last change of all files below a folder."""
    digest = hashlib.sha256()
    for part in sorted(p for p in folder.rglob("*") if p.is_file()):
        found = part.stat()
        digest.update(f"{part.relative_to(folder).as_posix()} {found.st_size} {found.st_mtime_ns}\n".encode())
    return digest.hexdigest()


def settings_key(settings: Sequence[Any]) -> str:
    """Return a key of the settings of a computation, 20 hexadecimal digits: equal settings, equal key."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:20]


def _version_of(distribution: str) -> str | None:
    # takes as long to load as half of NumPy, and only a manifest needs it
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(distribution)
    except PackageNotFoundError:
        return None


def versions() -> dict[str, str | None]:
    """Return the versions of Python, this package and those whose numbers it rests on."""
    own = {"python": platform.python_version(), "friction-bayes": _version_of("friction-bayes")}
    return own | {name: _version_of(name) for name in _VERSIONED}


def manifest(
    command: str, *, options: Mapping[str, Any], seed: int | None, inputs: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Collect what is needed to make a result again: options, seed, inputs, versions, platform and time.

    Parameters
    ----------
    command : str
        Name of the command.
    options : mapping
        Its options as parsed.
    seed : int or None
        Seed of everything random in it.
    inputs : mapping of str to str, optional
        Records that were read, with their sha256 digests.
    """
    return {
        "command": command,
        "options": dict(options),
        "seed": seed,
        "inputs": [{"record": name, "sha256": digest} for name, digest in (inputs or {}).items()],
        "versions": versions(),
        "platform": platform.platform(),
        "written": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def write_manifest(folder: Path, content: Mapping[str, Any]) -> None:
    """Write the :func:`manifest` of the results in ``folder``; call it last.

    Its files are listed, so that a later run knows which ones to replace.
    """
    write_json(folder / MANIFEST_NAME, {**content, "files": _files_below(folder)})


def _files_below(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def _files_of_earlier_run(folder: Path) -> list[str]:
    try:
        listed = json.loads((folder / MANIFEST_NAME).read_text(encoding="utf-8"))["files"]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    # A manifest is a file like any other: what it names outside of its folder must not be removed.
    inside = folder.resolve()
    return [name for name in listed if (folder / name).resolve().is_relative_to(inside)]


def nearest_existing(path: Path) -> Path:
    """Return the path, or the nearest of its parents that exists."""
    while not path.exists():
        path = path.parent
    return path


def check_folder_target(target: str | Path, *, force: bool) -> Path:
    """Return ``target`` as an absolute path, refusing a folder with files unless ``force`` is given."""
    folder, place = Path(target).absolute(), f"--out {target}"
    if folder.exists() and not folder.is_dir():
        raise InputError(place, "is a file", "give a folder")
    if folder.is_dir() and any(folder.iterdir()) and not force:
        raise InputError(place, "already holds files", "choose another folder or add --force")
    return folder


@contextmanager
def _aside(target: Path) -> Iterator[Path]:
    """Yield an empty folder on the file system of ``target``, gone afterwards whatever happens."""
    aside = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=nearest_existing(target.parent)))
    try:
        yield aside
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def cannot_be_written(place: str, error: OSError) -> InputError:
    """Return the refusal of a place that the operating system does not let us write to."""
    return InputError(place, f"cannot be written ({error.strerror or error})", "choose another")


@contextmanager
def output_folder(target: str | Path, *, force: bool = False) -> Iterator[Path]:
    """Yield a folder next to ``target`` to write into; its files come to ``target`` if all went well.

    Parameters
    ----------
    target : path
        The folder to make, and its parents where they are missing.
    force : bool
        Write into a folder that already holds files: those of an earlier run go, all others stay.

    Raises
    ------
    InputError
        If ``target`` holds files and ``force`` is not given, is a file, or cannot be written.
    """
    folder = check_folder_target(target, force=force)
    with ExitStack() as stack:
        try:
            aside = stack.enter_context(_aside(folder))
        except OSError as error:
            raise cannot_be_written(f"--out {target}", error) from None
        yield aside
        aside.chmod(0o755)
        if not folder.exists():
            folder.parent.mkdir(parents=True, exist_ok=True)
            aside.rename(folder)
            return
        for name in _files_of_earlier_run(folder):
            (folder / name).unlink(missing_ok=True)
        for name in _files_below(aside):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (aside / name).replace(folder / name)


def check_file_target(target: str | Path, *, force: bool = False) -> Path:
    """Return ``target`` as a path, refusing an existing file unless ``force`` is given."""
    path = Path(target)
    if path.is_dir():
        raise InputError(f"--out {target}", "is a folder", "give a file")
    if path.exists() and not force:
        raise InputError(f"--out {target}", "already exists", "choose another file or add --force")
    return path
