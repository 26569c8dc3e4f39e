"""``friction-bayes estimate``: friction of each record, in closed form, checked by emcee when asked."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import friction_bayes as fb
from friction_bayes.cli.console import (
    collected_warnings,
    compilation_noted,
    note,
    output_console,
    progress_bar,
)
from friction_bayes.cli.extensions import note_effects_without_part, register_extensions
from friction_bayes.cli.fleet_run import Fleet, fleet_of, is_finished
from friction_bayes.cli.options import (
    add_long_run,
    add_output_folder,
    add_seed,
    add_system,
    completed_by,
    key_values,
    options_of,
)
from friction_bayes.cli.records import (
    add_record,
    input_digests,
    load_decays,
    refuse_twice,
)
from friction_bayes.cli.sampled import figures_of_draws
from friction_bayes.core.errors import of_each
from friction_bayes.core.files import manifest, output_folder, write_json, write_manifest
from friction_bayes.core.strict_json import strict_json
from friction_bayes.core.text import fitted_part, number

if TYPE_CHECKING:
    import xarray as xr

    from friction_bayes.core.system import Oscillator
    from friction_bayes.decay.free_decay import FreeDecay
    from friction_bayes.estimators.result import Estimate
    from friction_bayes.reference.checking import ReferenceRun

__all__ = ["add_parser"]

Heading = list[tuple[str, str]]
"""Labels and texts to be seen before the numbers: what was read, and warnings."""

_EPILOG = """methods:
  waveform           conjugate regression on the whole signal (the default)
  envelope           conjugate regression on the amplitudes
  normal-gamma       the paper's: friction samples from successive amplitudes, Eqs. (4)-(8)
  gamma-exponential  the paper's comparison, which it rejects, Eqs. (9)-(11)

examples:
  friction-bayes estimate decay.csv --mass 10 --stiffness 1000
  friction-bayes estimate decay.csv --mass 10 --stiffness 1000 --stiffness-sd 20 --check --out results
  friction-bayes estimate decay.csv --mass 10 --stiffness 1000 --method normal-gamma \\
      --prior mu=0.1 lam=0.01 alpha=1 beta=0.02 --accept-precision 30
  friction-bayes estimate dataset:bicycle-fork --json
  friction-bayes estimate run?.csv --mass 10 --stiffness 1000
  friction-bayes estimate fleet.zarr --mass 10 --stiffness 1000 --out estimates.zarr
"""


_NOT_OF_A_FLEET = ("check", "setup", "accept_precision", "rest_position")
_NOTES = 3
"""Notes that are printed unless all are asked for."""


class _Record(NamedTuple):
    """A record, its system and the warnings with which it was read."""

    record: xr.DataArray
    system: Oscillator
    warned: list[str]


def add_parser(commands: Any) -> None:
    """Add ``estimate RECORD [RECORD ...] SYSTEM``."""
    parser = commands.add_parser(
        "estimate",
        help="friction of a record",
        description="Estimate friction from one free decay, or from each of several by itself.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument(
        "records", metavar="RECORD", nargs="+", help="files, dataset:NAME[/PART], or one FLEET.zarr"
    )
    model = parser.add_argument_group("estimate")
    method = model.add_argument(
        "--method", default="waveform", metavar="NAME", help="see below (default: waveform)"
    )
    completed_by(method, "friction_bayes.estimators.registry:ESTIMATORS")
    model.add_argument(
        "--prior",
        action="append",
        metavar="KEY=VALUE",
        help="instead of the default; several values, or repeated",
    )
    model.add_argument(
        "--peaks",
        default="highest",
        metavar="highest|nominal",
        help="sample that the paper's two methods take as the peak (default: highest)",
    )
    model.add_argument(
        "--rest-position", type=float, metavar="X", help="signal at rest (default: found in the record)"
    )
    model.add_argument(
        "--random-force",
        default="auto",
        metavar="auto|none",
        help="whether waveform averages over a force that fluctuates (default: auto)",
    )
    model.add_argument(
        "--check", action="store_true", help="sample the same posterior with emcee and compare"
    )
    add_seed(model)
    acceptance = model.add_mutually_exclusive_group()
    acceptance.add_argument(
        "--setup", metavar="RECORD", help="long set-up record whose precision sets the least accepted"
    )
    acceptance.add_argument("--accept-precision", type=float, metavar="S", help="least precision accepted")
    add_system(parser)
    add_record(parser)
    output = parser.add_argument_group("output")
    output.add_argument(
        "--json",
        action="store_true",
        help="print JSON, a list where there are several records, and nothing else",
    )
    output.add_argument("--verbose", action="store_true", help="print all notes, not the first three alone")
    add_output_folder(output)
    add_long_run(parser)
    parser.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> None:
    """Estimate, check, write and print."""
    refuse_twice(arguments.records)
    fleet = fleet_of(arguments, without=_NOT_OF_A_FLEET)
    if fleet is not None:
        if not is_finished("estimate", arguments, fleet):
            _fleet(arguments, fleet)
        return
    if arguments.out is None:
        results, headings, _ = _estimate_each(arguments, None)
    else:
        with output_folder(arguments.out, force=arguments.force) as folder:
            results, headings, drawings = _estimate_each(arguments, folder)
            write_json(folder / "estimate.json", results if len(results) > 1 else results[0])
            inputs = input_digests(*arguments.records, arguments.setup)
            made = manifest("estimate", options=options_of(arguments), seed=arguments.seed, inputs=inputs)
            _write_page(results, headings, drawings, made, folder)
            write_manifest(folder, made)
    if arguments.json:
        sys.stdout.write(strict_json(results if len(results) > 1 else results[0]) + "\n")
    else:
        from friction_bayes.cli.tables.estimate import estimate_table, records_table

        table = (
            records_table(results, headings)
            if len(results) > 1
            else estimate_table(results[0], headings[0], notes=None if arguments.verbose else _NOTES)
        )
        output_console().print(table)
    if arguments.out is not None:
        note(f"results and figures are in {arguments.out}")


def _fleet(arguments: argparse.Namespace, fleet: Fleet) -> None:
    """Estimate all records of a fleet, and print how many ended how."""
    from friction_bayes.cli.fleet_estimate import estimate_fleet

    counts = estimate_fleet(arguments, fleet)
    if arguments.json:
        sys.stdout.write(strict_json(counts) + "\n")
    else:
        from friction_bayes.cli.tables.fleet import counts_table

        output_console().print(counts_table(arguments.records[0], counts))
    note(f"the estimates are in {arguments.out}")


def _estimate_each(arguments: argparse.Namespace, folder: Path | None) -> tuple[tuple[Any, ...], ...]:
    """Estimate each record by itself; the files of several carry their number.

    Returns results for JSON, what is said before them, and SVG of the figures by name, one of each a record.
    """
    loaded = of_each(lambda source: _loaded(source, arguments), arguments.records)
    records = [record for records in loaded for record in records]
    several = len(records) > 1
    each = of_each(
        lambda each: _estimate(each[1], arguments, folder, f"_{each[0]}" if several else ""),
        enumerate(records, start=1),
    )
    return tuple(zip(*each, strict=True))


def _loaded(source: str, arguments: argparse.Namespace) -> list[_Record]:
    """Read a record, or the decays of one that ``--decay`` chooses."""
    with collected_warnings() as warned:
        note_effects_without_part(register_extensions(arguments.register), "estimate")
        decays, system = load_decays(source, arguments)
    return [_Record(decay, system, warned) for decay in decays]


def _estimate(
    loaded: _Record, arguments: argparse.Namespace, folder: Path | None, suffix: str
) -> tuple[dict[str, Any], Heading, dict[str, bytes]]:
    """Return result, what is said before it and SVGs; write files, their names ending in ``suffix``."""
    from friction_bayes.records.description import what_was_read

    reference = None
    record, system, warned_before = loaded
    with collected_warnings() as found:
        setup = None if arguments.setup is None else _setup(arguments)
        with compilation_noted():
            estimate = fb.estimate(
                record,
                system,
                method=arguments.method,
                prior=key_values(arguments.prior, "--prior"),
                peaks=arguments.peaks,
                setup=setup,
                accept_precision=arguments.accept_precision,
                # a chosen decay begins where it was found
                start=None if arguments.decay else arguments.start,
                rest_position=arguments.rest_position,
                random_force=arguments.random_force,
            )
        if arguments.check:
            reference = _check(estimate, arguments.seed)
    warned = [*warned_before, *found]
    result = estimate.to_dict(None if reference is None else reference.summary)
    result["notes"].extend(text for text in warned if text not in result["notes"])
    drawings = {} if folder is None else _write(estimate, record, reference, folder, suffix)
    heading = [("read", f"{what_was_read(record)}; {_fitted(estimate.decay)}")]
    return result, heading + [("warning", text) for text in warned], drawings


def _setup(arguments: argparse.Namespace) -> xr.DataArray:
    """Read the set-up record, which is taken whole."""
    whole = argparse.Namespace(**{**vars(arguments), "start": None, "end": None, "decay": None})
    return load_decays(arguments.setup, whole)[0][0]


def _fitted(decay: FreeDecay) -> str:
    """Say which part of the record the fit took, and the amplitude there by the rms of half a period."""
    duration = decay.step * (decay.values.size - 1)
    half_cycles = int(duration * decay.frequency / math.pi)
    first = decay.values[: math.ceil(math.pi / (decay.frequency * decay.step))] - decay.rest_position
    amplitude = number(math.sqrt(2.0 * float(first @ first) / first.size), 2)
    part = fitted_part(decay.start_time, decay.start_time + duration, half_cycles)
    return f"{part}, first amplitude {amplitude} {decay.unit}"


# emcee, ArviZ and matplotlib take seconds to load: they are imported where they are needed.


def _write(
    estimate: Estimate, record: xr.DataArray, reference: ReferenceRun | None, folder: Path, suffix: str
) -> dict[str, bytes]:
    """Write figures and draws, and return the figures as SVG."""
    from friction_bayes.plotting import write_figures
    from friction_bayes.plotting.estimate import estimate_figures

    figures = estimate_figures(estimate, record, reference)
    if reference is not None:
        from friction_bayes.reference import save_tree

        save_tree(reference.tree, folder / f"reference{suffix}.nc")
        figures |= figures_of_draws(reference.tree)
    return write_figures(figures, folder, suffix)


def _write_page(
    results: Sequence[dict[str, Any]],
    headings: Sequence[Heading],
    drawings: Sequence[dict[str, bytes]],
    made: Mapping[str, Any],
    folder: Path,
) -> None:
    """Write ``report.html``."""
    from friction_bayes.report.estimate import EstimatedRecord, estimate_page

    entries = [
        EstimatedRecord(
            result=result,
            read=dict(rows)["read"],
            figures=figures,
            warnings=[text for label, text in rows if label == "warning"],
        )
        for result, rows, figures in zip(results, headings, drawings, strict=True)
    ]
    (folder / "report.html").write_text(estimate_page(entries, made), encoding="utf-8")


def _check(estimate: Estimate, seed: int) -> ReferenceRun:
    from friction_bayes.reference.checking import check_estimate

    with progress_bar() as bar:
        task = bar.add_task("emcee", total=None)
        return check_estimate(
            estimate, seed=seed, progress=lambda done, due: bar.update(task, completed=done, total=due)
        )
