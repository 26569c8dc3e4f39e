"""``friction-bayes monitor``: friction over detection points T1..Tn, and the remaining life."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import friction_bayes as fb
from friction_bayes.cli.console import collected_warnings, note, output_console, progress_bar
from friction_bayes.cli.extensions import note_effects_without_part, register_extensions
from friction_bayes.cli.options import add_long_run, add_output_folder, add_system, options_of, system_of
from friction_bayes.cli.records import (
    EACH_DECAY,
    add_record,
    input_digests,
    load_records,
    what_was_read_of_each,
)
from friction_bayes.core.checks import positive
from friction_bayes.core.errors import InputError, of_each
from friction_bayes.core.files import manifest, output_folder, write_json, write_manifest

if TYPE_CHECKING:
    import xarray as xr

    from friction_bayes.core.system import Oscillator

__all__ = ["add_parser"]

_NOT_OF_A_FLEET = (
    "times",
    "time_unit",
    "time_column",
    "scale",
    "run",
    "skip_rows",
    "duplicates",
    "start",
    "end",
    "decay",
    "register",
)
_EPILOG = """when the records were taken:
  --times, or the attribute detection_time of each record (a coordinate of a fleet), or their order;
  the decays of a single recording were taken when they begin

examples:
  friction-bayes monitor run1.csv run2.csv run3.csv --mass 10 --stiffness 1000 \\
      --times 0 120 260 --time-unit h --threshold 0.3 --out wear
  friction-bayes monitor run*.csv --mass 10 --stiffness 1000 --out wear
  friction-bayes monitor fleet.zarr --mass 10 --stiffness 1000 --threshold 0.3 --out fleet
"""


def add_parser(commands: Any) -> None:
    """Add ``monitor RECORD [RECORD ...] | FLEET.zarr SYSTEM --out DIR``."""
    parser = commands.add_parser(
        "monitor",
        help="friction over detection points",
        description="Follow the friction of a machine or a fleet over its detection points T1, T2, ... Tn.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument(
        "records",
        nargs="+",
        metavar="RECORD",
        help="two or more in time order, a recording of several decays, or one FLEET.zarr",
    )
    points = parser.add_argument_group("monitor")
    points.add_argument("--threshold", type=float, metavar="F", help="friction at which the machine fails")
    points.add_argument(
        "--times", nargs="+", metavar="T", help="one per record: numbers, or dates (ISO 8601)"
    )
    points.add_argument("--time-unit", metavar="UNIT", help="unit of the numbers of --times, such as h")
    add_system(parser)
    add_record(parser)
    output = parser.add_argument_group("output")
    add_output_folder(output)
    add_long_run(parser.add_argument_group("fleet"))
    parser.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> None:
    """Monitor one machine or a fleet, write and print."""
    if arguments.out is None:
        raise InputError("--out", "is missing", "give a folder for the report and the figures")
    if arguments.threshold is not None:
        positive("--threshold", arguments.threshold)
    if arguments.workers is not None and arguments.workers < 1:
        raise InputError("--workers", f"{arguments.workers} is not a number of threads", "give 1 or more")
    fleet = _open_fleet(arguments)
    if fleet is None:
        for option in ("resume", "workers", "scheduler"):
            if getattr(arguments, option):
                raise InputError(f"--{option}", "is for a fleet", "leave it out")
    with output_folder(arguments.out, force=arguments.force) as folder:
        table = _one_machine(arguments, folder) if fleet is None else _fleet(arguments, fleet, folder)
    output_console().print(table)
    note(f"report.html and figures are in {arguments.out}")


def _one_machine(arguments: argparse.Namespace, folder: Path) -> Any:
    if arguments.time_unit is not None and arguments.times is None:
        raise InputError("--time-unit", "is given without --times", "give both")
    with collected_warnings() as warned:
        note_effects_without_part(register_extensions(arguments.register), "monitor")
        each = arguments.decay in (None, EACH_DECAY)
        taken = argparse.Namespace(**{**vars(arguments), "decay": None if each else arguments.decay})
        records, system = load_records(arguments.records, taken)
        if each:
            records = _each_decay(records, system)
        report = fb.monitor_records(
            records,
            system,
            threshold=arguments.threshold,
            times=arguments.times,
            time_unit=arguments.time_unit,
        )
    from friction_bayes.cli.tables.monitor import monitor_table
    from friction_bayes.plotting import write_figures
    from friction_bayes.plotting.monitor import monitor_figures
    from friction_bayes.report.monitor import monitor_page

    notes = [text for known in report.manipulation for text in known["notes"]]
    result = report.to_dict() | {"notes": list(dict.fromkeys([*warned, *notes]))}
    write_json(folder / "monitor.json", result)
    report.to_dataset().to_netcdf(folder / "monitor.nc", engine="h5netcdf")
    drawings = write_figures(monitor_figures(report), folder)
    made = _write_manifest(arguments, input_digests(*arguments.records), folder)
    from friction_bayes.records.description import what_was_read

    alike = {what_was_read(record) for record in records}
    read = list(alike) if len(alike) == 1 else what_was_read_of_each(records)
    (folder / "report.html").write_text(monitor_page(result, read, drawings, made), encoding="utf-8")
    return monitor_table(result, read)


def _write_manifest(
    arguments: argparse.Namespace, inputs: Mapping[str, str], folder: Path
) -> Mapping[str, Any]:
    made = manifest("monitor", options=options_of(arguments), seed=None, inputs=inputs)
    write_manifest(folder, made)
    return made


def _each_decay(records: Sequence[xr.DataArray], system: Oscillator) -> list[xr.DataArray]:
    """Cut each recording into its decays; those of the only one were taken when they begin."""
    from friction_bayes.monitor.points import TIME_ATTRIBUTE

    split = of_each(lambda record: fb.split_decays(record, system), records)
    decays = [decay for of_one in split for decay in of_one]
    if len(records) > 1 or len(decays) == 1:
        return decays
    return [
        decay.assign_attrs({TIME_ATTRIBUTE: float(decay["time"].values[0]), f"{TIME_ATTRIBUTE}_units": "s"})
        for decay in decays
    ]


def _open_fleet(arguments: argparse.Namespace) -> xr.DataArray | None:
    """Return the records of a fleet, still on disk, if that is what the one argument names."""
    folders = [
        path for path in map(Path, arguments.records) if path.suffix.lower() == ".zarr" and path.is_dir()
    ]
    if not folders:
        return None
    from friction_bayes.records.fleet import open_fleet

    fleets = [found for folder in folders if (found := open_fleet(folder)) is not None]
    if not fleets:
        return None
    if len(arguments.records) > 1:
        raise InputError("records", "a fleet among other records", "give a fleet alone")
    (fleet,) = fleets
    for option in _NOT_OF_A_FLEET:
        if getattr(arguments, option):
            name = f"--{option.replace('_', '-')}"
            raise InputError(
                name,
                "does not apply to a fleet",
                "leave it out: the coordinates of the Zarr say what it holds",
            )
    return fleet


def _fleet(arguments: argparse.Namespace, records: xr.DataArray, folder: Path) -> Any:
    from friction_bayes.monitor.fleet import fleet_work
    from friction_bayes.monitor.resumable_run import parts_folder, run_key

    inputs = input_digests(*arguments.records)
    work = fleet_work(records, system_of(arguments), threshold=arguments.threshold)
    key = run_key("monitor", options_of(arguments), inputs)
    with parts_folder(arguments.out, key, resume=arguments.resume, note=note) as parts:
        with _dask_workers(arguments.scheduler, arguments.workers):
            fleet = work.resume(parts, note=note)
        return _write_fleet(fleet, folder, _write_manifest(arguments, inputs, folder))


def _write_fleet(fleet: xr.Dataset, folder: Path, made: Mapping[str, Any]) -> Any:
    """Write files, figure and page; return the table."""
    from friction_bayes.cli.tables.monitor import fleet_table
    from friction_bayes.monitor.fleet_report import fleet_report
    from friction_bayes.plotting import write_figures
    from friction_bayes.plotting.monitor import plot_fleet
    from friction_bayes.report.monitor import fleet_page

    fleet.to_netcdf(folder / "monitor.nc", engine="h5netcdf")
    drawings = write_figures({"fleet": plot_fleet(fleet)}, folder)
    result = fleet_report(fleet)
    write_json(folder / "monitor.json", result)
    (folder / "report.html").write_text(fleet_page(result, drawings["fleet"], made), encoding="utf-8")
    return fleet_table(result)


@contextmanager
def _dask_workers(scheduler: str | None, workers: int | None) -> Iterator[None]:
    """Let Dask work on a cluster, or in threads with a progress bar."""
    import dask
    from dask.callbacks import Callback

    if scheduler is not None:
        from dask.distributed import Client

        try:
            client = Client(scheduler, timeout=10)
        except (OSError, ValueError) as error:
            raise InputError("--scheduler", f"{scheduler} does not answer ({error})", "start it") from None
        with client:
            yield
        return
    options = {"scheduler": "threads"} | ({} if workers is None else {"num_workers": workers})
    with progress_bar() as bar, dask.config.set(options):
        task = bar.add_task("fleet", total=None)
        with Callback(posttask=lambda *_: bar.advance(task)):
            yield
