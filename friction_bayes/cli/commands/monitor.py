"""``friction-bayes monitor``: friction over detection points T1..Tn, and the remaining life."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import friction_bayes as fb
from friction_bayes.cli.console import collected_warnings, note, output_console
from friction_bayes.cli.extensions import note_effects_without_part, register_extensions
from friction_bayes.cli.fleet_run import (
    Fleet,
    FleetPart,
    finished_parts,
    fleet_manifest,
    fleet_of,
    is_finished,
    rows_of,
)
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
from friction_bayes.core.files import (
    check_folder_target,
    manifest,
    output_folder,
    write_json,
    write_manifest,
    write_whole,
)

if TYPE_CHECKING:
    import xarray as xr

    from friction_bayes.core.system import Oscillator

__all__ = ["add_parser"]

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
    add_long_run(parser)
    parser.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> None:
    """Monitor one machine or a fleet, write and print."""
    if arguments.out is None:
        raise InputError("--out", "is missing", "give a folder for the report and the figures")
    if arguments.threshold is not None:
        positive("--threshold", arguments.threshold)
    fleet = fleet_of(arguments, without=("times", "time_unit"))
    if fleet is None:
        with output_folder(arguments.out, force=arguments.force) as folder:
            table = _one_machine(arguments, folder)
    elif is_finished("monitor", arguments, fleet):
        return
    else:
        table = _fleet(arguments, fleet)
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
    inputs = input_digests(*arguments.records)
    made = manifest("monitor", options=options_of(arguments), seed=None, inputs=inputs)
    from friction_bayes.records.description import what_was_read

    alike = {what_was_read(record) for record in records}
    read = list(alike) if len(alike) == 1 else what_was_read_of_each(records)
    (folder / "report.html").write_text(monitor_page(result, read, drawings, made), encoding="utf-8")
    write_manifest(folder, made)
    return monitor_table(result, read)


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


def _fleet(arguments: argparse.Namespace, fleet: Fleet) -> Any:
    import xarray as xr

    from friction_bayes.monitor.fleet import fleet_times

    check_folder_target(arguments.out, force=arguments.force)
    system = system_of(arguments)
    records = fleet.open()
    fleet_times(records)
    work = partial(_fleet_part, fleet=fleet, system=system, threshold=arguments.threshold)
    rows = rows_of(fleet, records)
    with finished_parts("monitor", arguments, fleet, rows, work, ".nc") as files:
        parts = [xr.load_dataset(file, engine="h5netcdf", decode_timedelta=False) for file in files]
        whole = xr.concat(
            parts, "machine", data_vars="minimal", coords="minimal", compat="override", join="exact"
        )
        made = fleet_manifest("monitor", arguments, fleet)
        with output_folder(arguments.out, force=arguments.force) as folder:
            return _write_fleet(whole, folder, made)


def _fleet_part(part: FleetPart, *, fleet: Fleet, system: Oscillator, threshold: float | None) -> None:
    import dask

    which, file = part
    with dask.config.set(scheduler="sync"):
        found = fb.monitor_fleet(fleet.open()[which], system, threshold=threshold)
    write_whole(file, lambda path: found.to_netcdf(path, engine="h5netcdf"))


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
    write_manifest(folder, made)
    return fleet_table(result)
