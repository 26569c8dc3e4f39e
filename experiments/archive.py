"""Results that back the tables of the documentation, kept in the repository: audited without a run.

Of each experiment the dataset that its tables are made of, compressed without a loss, and its manifest:
settings, seed, versions, platform, commit and digest of the sources that computed it.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import xarray as xr

from experiments.docs import section
from experiments.runner import Experiment, tables
from experiments.sources import stored_result
from friction_bayes.core.errors import InputError
from friction_bayes.core.files import write_whole

__all__ = ["archived", "keep", "section_of"]

_ENDS = (".nc", ".json")


def keep(experiment: Experiment, results: Path, archive: Path) -> None:
    """Put the result of an experiment into the archive, in place of an earlier one.

    Samples of measured records stay out: they are for their authors to pass on.

    Parameters
    ----------
    experiment : Experiment
    results, archive : Path
        Folders from and to.
    """
    archive.mkdir(parents=True, exist_ok=True)
    stored, record = (f"{experiment.name}{end}" for end in _ENDS)
    shutil.copyfile(results / record, archive / record)
    if experiment.group != "measured":
        shutil.copyfile(results / stored, archive / stored)
        return
    with xr.open_dataset(results / stored, engine="h5netcdf") as opened:
        dataset = opened.load().drop_dims("sample", errors="ignore")
    write_whole(archive / stored, lambda path: dataset.to_netcdf(path, engine="h5netcdf"))


def archived(archive: Path) -> list[str]:
    """Return the names of the experiments in an archive."""
    return sorted(path.stem for path in archive.glob("*.nc"))


def section_of(experiment: Experiment, archive: Path) -> str:
    """Return the tables of an experiment, made of what the archive has, as the documentation shows them.

    Parameters
    ----------
    experiment : Experiment
    archive : Path

    Raises
    ------
    InputError
        If the archive has no result of it.
    """
    stored, record = (archive / f"{experiment.name}{end}" for end in _ENDS)
    if not (stored.is_file() and record.is_file()):
        raise InputError(
            f"{archive}",
            f"no result of {experiment.name}",
            f"it has {', '.join(archived(archive)) or 'none'}; run the experiment with --archive",
        )
    _, text = tables(experiment, stored_result(experiment.name, archive))
    return section(json.loads(record.read_text(encoding="utf-8")), text)
