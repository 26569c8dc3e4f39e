"""``close-loop`` of a fleet: each record by itself, a line each in two files."""

from __future__ import annotations

import argparse
import csv
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import friction_bayes as fb
from friction_bayes.cli.console import collected_warnings
from friction_bayes.cli.fleet_run import Fleet, FleetPart, finished_parts, fleet_manifest
from friction_bayes.cli.options import system_of
from friction_bayes.core.errors import InputError
from friction_bayes.core.files import (
    check_folder_target,
    output_folder,
    write_json,
    write_manifest,
    write_whole,
)
from friction_bayes.core.strict_json import strict_json
from friction_bayes.core.system import Oscillator
from friction_bayes.loop.data.options import TOLERANCE, LoopOptions

__all__ = ["close_fleet"]

_REFUSED = "refused"
"""What a record that cannot be used has in place of a report, and as its verdict."""
_COLUMNS = ("verdict", "effects", "friction", "sd", "low", "high", "unit")


def close_fleet(arguments: argparse.Namespace, fleet: Fleet, asked: Mapping[str, Any]) -> dict[str, Any]:
    """Close the loop on each record; return how many have which verdict and which effects.

    Raises
    ------
    InputError
        If the folder cannot be written, or an option is wrong.
    """
    check_folder_target(arguments.out, force=arguments.force)
    system = system_of(arguments)
    asked = {"tolerance": TOLERANCE, **asked}
    # what is refused of every record is refused now
    LoopOptions(**asked, varying_friction=False, check=False).validate(())
    records = fleet.open()
    which = list(product(*(range(n) for n in records.shape[:-1])))
    work = partial(_close_part, fleet=fleet, system=system, asked=asked)
    with (
        finished_parts("close-loop", arguments, fleet, which, work, ".json") as files,
        output_folder(arguments.out, force=arguments.force) as folder,
    ):
        counts = _written(files, folder, [str(name) for name in records.dims[:-1]])
        write_manifest(folder, fleet_manifest("close-loop", arguments, fleet))
    return counts


def _close_part(part: FleetPart, *, fleet: Fleet, system: Oscillator, asked: Mapping[str, Any]) -> None:
    which, file = part
    records = fleet.open()
    record = records[which].compute(scheduler="sync")
    where = {str(name): record.coords[name].item() for name in records.dims[:-1]}
    record.attrs["name"] = ", ".join(f"{name} {value}" for name, value in where.items())
    with collected_warnings() as warned:
        try:
            report = fb.close_loop(record, system, **asked).to_dict()
        except InputError as error:
            found: dict[str, Any] = {_REFUSED: str(error)}
        else:
            # how long it took is the one thing that is not the same when it is done again
            found = {name: value for name, value in report.items() if name != "elapsed_s"}
    if _REFUSED not in found:
        found["notes"] = list(dict.fromkeys([*found["notes"], *warned]))
    write_whole(file, lambda path: write_json(path, where | found))


def _written(files: Sequence[Path], folder: Path, dimensions: Sequence[str]) -> dict[str, Any]:
    """Write all reports, one a line, and a table of them; one is in memory at a time."""
    verdicts: Counter[str] = Counter()
    effects: Counter[str] = Counter()
    with (
        (folder / "reports.jsonl").open("w", encoding="utf-8") as lines,
        (folder / "loop.csv").open("w", encoding="utf-8", newline="") as table,
    ):
        rows = csv.writer(table)
        rows.writerow([*dimensions, *_COLUMNS])
        for file in files:
            found = json.loads(file.read_text(encoding="utf-8"))
            lines.write(strict_json(found, indent=None) + "\n")
            where = [found[name] for name in dimensions]
            if _REFUSED in found:
                verdicts[_REFUSED] += 1
                rows.writerow([*where, _REFUSED, *("" for _ in _COLUMNS[1:])])
                continue
            names = [effect["name"] for effect in found["effects"]]
            verdicts[found["verdict"]] += 1
            effects.update(names)
            friction = found["friction_after"]
            numbers = [friction["mean"], friction["sd"], *friction["interval90"], friction["unit"]]
            rows.writerow([*where, found["verdict"], " ".join(names), *numbers])
    return {"records": len(files), "verdict": dict(verdicts), "effects": dict(effects)}
