"""Archives that hold one recording, such as phyphox exports; nothing is unpacked to disk."""

from __future__ import annotations

import zipfile
from pathlib import Path, PurePosixPath

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.table import Table
from friction_bayes.records.readers.text import TEXT_SUFFIXES, decode, table_of_lines

__all__ = ["check_unpacked_size", "is_zip", "read_archive"]

_MOST_BYTES = 1 << 30
"""That an archive may unpack to."""
_NO_RECORDING = {"meta", "__MACOSX"}
"""Folders of what was noted about the recording: by phyphox, and by the archiver of macOS."""


def is_zip(path: Path) -> bool:
    """Whether a file is a ZIP archive, whatever its name."""
    return zipfile.is_zipfile(path)


def check_unpacked_size(path: Path) -> None:
    """Refuse an archive that would fill the memory.

    Raises
    ------
    InputError
        Saying what it would unpack to.
    """
    with zipfile.ZipFile(path) as archive:
        size = sum(member.file_size for member in archive.infolist())
    if size > _MOST_BYTES:
        raise InputError(
            str(path),
            f"unpacks to {size / 2**20:.0f} MB, more than {_MOST_BYTES / 2**20:.0f}",
            "give the recording by itself, as CSV",
        )


def read_archive(path: Path) -> Table:
    """Read the one text table of a ZIP archive.

    Parameters
    ----------
    path : Path
        The archive. Its folder ``meta``, as phyphox writes it, holds no recording.

    Raises
    ------
    InputError
        If it is no archive, unpacks to too much, or holds no text table or several.
    """
    if not is_zip(path):
        raise InputError(str(path), "this is not a ZIP file", "give the recording by itself")
    check_unpacked_size(path)
    with zipfile.ZipFile(path) as archive:
        found = [name for name in archive.namelist() if _is_recording(PurePosixPath(name))]
        if len(found) != 1:
            what = f"several tables: {', '.join(sorted(found)[:6])}" if found else "no text table"
            raise InputError(str(path), f"the archive holds {what}", "take out the one that is meant")
        try:
            raw = archive.read(found[0])
        except (zipfile.BadZipFile, RuntimeError, NotImplementedError) as error:
            raise InputError(
                str(path), f"{found[0]} cannot be taken out ({error})", "give it by itself"
            ) from None
    return table_of_lines(path / found[0], decode(path, raw).splitlines())


def _is_recording(member: PurePosixPath) -> bool:
    return member.suffix.lower() in TEXT_SUFFIXES and not _NO_RECORDING.intersection(member.parts)
