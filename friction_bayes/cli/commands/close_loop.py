"""``friction-bayes close-loop``: from the residual of a Coulomb model to the effect that it lacks."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import friction_bayes as fb
from friction_bayes.cli.console import (
    collected_warnings,
    compilation_noted,
    note,
    output_console,
    progress_bar,
)
from friction_bayes.cli.extensions import register_extensions
from friction_bayes.cli.fleet_run import Fleet, fleet_of, is_finished
from friction_bayes.cli.options import (
    add_long_run,
    add_output_folder,
    add_seed,
    add_system,
    completed_by,
    options_of,
)
from friction_bayes.cli.records import (
    add_record,
    input_digests,
    load_records,
    what_was_read_of_each,
)
from friction_bayes.core.checks import positive
from friction_bayes.core.errors import InputError
from friction_bayes.core.files import manifest, output_folder, write_manifest
from friction_bayes.core.strict_json import strict_json
from friction_bayes.core.text import fitted_part, words

if TYPE_CHECKING:
    import xarray as xr

    from friction_bayes.core.system import Oscillator
    from friction_bayes.loop import LoopReport

__all__ = ["add_parser"]

_EPILOG = """verdicts:
  adequate     Coulomb friction alone leaves only noise, and what a sensor adds to any motion
  explained    one set of effects holds at least 95 % of the probability
  ambiguous    several sets hold it together; the next experiment would separate them
  unexplained  what is left, the forecast, or records or witnesses at odds forbid to use the number

examples:
  friction-bayes close-loop decay.csv --mass 10 --stiffness 1000 --out loop
  friction-bayes close-loop high.csv low.csv --mass 10 --stiffness 1000 --exclude friction_drift --out loop
  friction-bayes close-loop dataset:map-single-pendulum --check --out loop
  friction-bayes close-loop fleet.zarr --mass 10 --stiffness 1000 --out loops
"""

_NOT_OF_A_FLEET = ("check", "varying_friction", "reference_force")


def add_parser(commands: Any) -> None:
    """Add ``close-loop RECORD [RECORD ...] SYSTEM --out DIR``."""
    parser = commands.add_parser(
        "close-loop",
        help="find the effects that the Coulomb model lacks",
        description="Fit the Coulomb model to the whole signal, trace the residual to effects with "
        "probabilities, and report error and friction before and after. Several records of one system "
        "are fitted together; those of a fleet one by one.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument(
        "records",
        metavar="RECORD",
        nargs="+",
        help="files, or dataset:NAME[/PART], of one system and quantity; or one FLEET.zarr",
    )
    model = parser.add_argument_group("loop")
    which = model.add_mutually_exclusive_group()
    for option, text in (
        ("effects", "try these effects only (default: the catalogue)"),
        ("exclude", "try all effects but these"),
    ):
        chosen = which.add_argument(f"--{option}", metavar="A,B,..", help=text)
        completed_by(chosen, "friction_bayes.mechanics.effects:EFFECTS")
    model.add_argument(
        "--noise",
        default="auto",
        metavar="auto|white|ar",
        help="white, coloured, or as the record shows (default: auto)",
    )
    model.add_argument(
        "--random-force",
        default="auto",
        metavar="auto|none",
        help="evaluate a force that fluctuates in addition to the effects, or leave it out (default: auto)",
    )
    model.add_argument(
        "--varying-friction",
        action="store_true",
        help="friction differs between the records: report its mean, its spread and each record's own "
        "(default: as the records show)",
    )
    model.add_argument(
        "--tolerance",
        type=float,
        metavar="SHARE",
        help="share of friction below which a force left over that follows the motion does not matter "
        "(default: 0.2)",
    )
    model.add_argument(
        "--check",
        action=argparse.BooleanOptionalAction,
        default=False,
        help="sample the most probable candidate with emcee too; changes no other number (default: no)",
    )
    reference = model.add_mutually_exclusive_group()
    reference.add_argument(
        "--reference-friction", type=float, metavar="F", help="friction known from another source [N or N m]"
    )
    reference.add_argument(
        "--reference-force", metavar="FILE", help="friction force measured with the first record"
    )
    add_seed(model)
    add_system(parser)
    add_record(parser)
    output = parser.add_argument_group("output")
    output.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    add_output_folder(output, required=True)
    add_long_run(parser)
    parser.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> None:
    """Close the loop, write and print."""
    fleet = fleet_of(arguments, without=_NOT_OF_A_FLEET)
    if fleet is not None:
        if not is_finished("close-loop", arguments, fleet):
            _fleet(arguments, fleet)
        return
    with output_folder(arguments.out, force=arguments.force) as folder:
        result, read = _close(arguments, folder)
    if arguments.json:
        sys.stdout.write(strict_json(result) + "\n")
    else:
        from friction_bayes.cli.tables.loop import loop_table

        title = ", ".join(arguments.records)
        output_console().print(loop_table(title, result, read))
    note(f"report.html, figures and draws are in {arguments.out}")


def _fleet(arguments: argparse.Namespace, fleet: Fleet) -> None:
    """Close the loop on each record of a fleet, and print how many ended how."""
    from friction_bayes.cli.fleet_loop import close_fleet

    counts = close_fleet(arguments, fleet, _asked(arguments))
    if arguments.json:
        sys.stdout.write(strict_json(counts) + "\n")
    else:
        from friction_bayes.cli.tables.fleet import counts_table

        output_console().print(counts_table(arguments.records[0], counts))
    note(f"loop.csv and reports.jsonl are in {arguments.out}")


def _asked(arguments: argparse.Namespace) -> dict[str, Any]:
    """What is asked of the loop, of one record or of each of a fleet."""
    if arguments.reference_friction is not None:
        positive("--reference-friction", arguments.reference_friction)
    asked = {
        "seed": arguments.seed,
        "effects": _names(arguments.effects, "--effects"),
        "exclude": _names(arguments.exclude, "--exclude") or (),
        "noise": arguments.noise,
        "random_force": arguments.random_force,
        "reference_friction": arguments.reference_friction,
    }
    if arguments.tolerance is not None:
        asked["tolerance"] = positive("--tolerance", arguments.tolerance)
    return asked


def _close(arguments: argparse.Namespace, folder: Path) -> tuple[dict[str, Any], list[str]]:
    """Return the result and what was read, a line a record; write report, draws and figures."""
    asked = _asked(arguments)
    register_extensions(arguments.register)
    with collected_warnings() as warned:
        records, system = load_records(arguments.records, arguments)
        force = None
        if arguments.reference_force is not None:
            from friction_bayes.records.force import read_force

            force = read_force(arguments.reference_force, records[0])
        report = _search(
            records,
            system,
            varying_friction=arguments.varying_friction,
            check=arguments.check,
            reference_force=force,
            **asked,
        )
    result = report.to_dict()
    result["notes"] = list(dict.fromkeys([*result["notes"], *warned]))
    inputs = input_digests(*arguments.records, arguments.reference_force)
    made = manifest("close-loop", options=options_of(arguments), seed=arguments.seed, inputs=inputs)
    # matplotlib takes a second to load, which bad input need not wait for
    from friction_bayes.cli.loop_folder import write_loop

    write_loop(report, result, made, folder)
    write_manifest(folder, made)
    read = what_was_read_of_each(records)
    # the part fitted is that of the first record
    fitted = result["fitted"]
    read[0] += f"; {fitted_part(fitted['from_s'], fitted['to_s'], fitted['half_cycles'])}"
    return result, read


def _names(text: str | None, option: str) -> tuple[str, ...] | None:
    """Split ``A,B,..``."""
    if text is None:
        return None
    names = tuple(name.strip() for name in text.split(","))
    if "" in names:
        raise InputError(
            option, f"{text!r} has an empty name", "write effects like viscous_damping,sensor_drift"
        )
    return names


def _search(records: Sequence[xr.DataArray], system: Oscillator, **asked: Any) -> LoopReport:
    with compilation_noted(), progress_bar() as bar:
        task = bar.add_task("reading", total=None)
        fitted = 0

        def advance(name: str) -> None:
            nonlocal fitted
            fitted += 1
            bar.update(task, description=words(name), completed=fitted)

        return fb.close_loop(records, system, progress=advance, **asked)
