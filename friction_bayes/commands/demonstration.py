"""The demo: two synthetic records, estimated by every method, each beside its emcee reference."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import xarray as xr

import friction_bayes as fb
from friction_bayes.commands.check import ReferenceRun, check_estimate
from friction_bayes.commands.console import collected_warnings, note, output_console, progress_bar
from friction_bayes.commands.figures import draw_comparison, draw_joint, draw_signal
from friction_bayes.commands.options import options_of
from friction_bayes.commands.tables import comparison_table
from friction_bayes.forces import Estimate
from friction_bayes.mechanics.oscillator import Oscillator
from friction_bayes.mechanics.testbed import PAPER_SYSTEM, TESTBED, paper_example, paper_testbed
from friction_bayes.output import output_folder, write_json, write_manifest

__all__ = ["METHODS", "Case", "demonstrate"]

_PAPER_FRICTION = 0.07
_TESTBED_FRICTION = 0.2933
_DAMPING_RATIO = 0.001
METHODS = ("envelope", "normal-gamma", "gamma-exponential")


@dataclass(frozen=True, kw_only=True)
class Case:
    """A synthetic record with its true friction.

    Attributes
    ----------
    name : str
        Stem of its files.
    title : str
        What it is, in a line.
    record : xarray.DataArray
    system : Oscillator
    friction : float
        True friction force [N].
    """

    name: str
    title: str
    record: xr.DataArray
    system: Oscillator
    friction: float


def demonstrate(arguments: argparse.Namespace) -> None:
    """Make both records, estimate, check, draw and print."""
    started = perf_counter()
    tables, results = [], {}
    with output_folder(arguments.out, force=arguments.force) as folder:
        with progress_bar() as bar, collected_warnings() as warned:
            task = bar.add_task("compiling", total=2 * len(METHODS))
            for case in _cases(arguments.seed):
                estimates, checks = [], {}
                for method in METHODS:
                    bar.update(task, description=f"{case.title}: {method}")
                    estimate = fb.estimate(case.record, case.system, method=method)
                    estimates.append(estimate)
                    checks[method] = check_estimate(estimate, seed=arguments.seed)
                    bar.advance(task)
                _draw(case, estimates, checks, folder)
                rows = [each.to_dict(checks[each.method].summary) for each in estimates]
                tables.append(comparison_table(case.title, case.friction, rows))
                results[case.name] = {"true_friction": case.friction, "estimates": rows}
        write_json(folder / "demo.json", results)
        write_manifest(folder, "demo", options=options_of(arguments), seed=arguments.seed)
    console = output_console()
    for table in tables:
        console.print(table)
    for text in warned:
        note(text)
    console.print(f"{perf_counter() - started:.0f} s in all; figures and numbers are in {arguments.out}")


def _cases(seed: int) -> tuple[Case, Case]:
    return (
        Case(
            name="paper",
            title="The paper's numerical example",
            record=paper_example(seed),
            system=PAPER_SYSTEM,
            friction=_PAPER_FRICTION,
        ),
        Case(
            name="testbed",
            title=f"Testbed, acceleration, with viscous damping {_DAMPING_RATIO:g} in it",
            record=paper_testbed(
                _TESTBED_FRICTION, seed=seed, effects={"viscous_damping.damping_ratio": _DAMPING_RATIO}
            ),
            system=TESTBED,
            friction=_TESTBED_FRICTION,
        ),
    )


def _draw(
    case: Case, estimates: Sequence[Estimate], checks: Mapping[str, ReferenceRun], folder: Path
) -> None:
    prefix = f"{case.name}_"
    by_method = {each.method: each for each in estimates}
    draw_signal(by_method["envelope"], case.record, folder, prefix=prefix)
    draw_joint(by_method["normal-gamma"], folder, f"{prefix}joint", truth=case.friction)
    draw_comparison(estimates, checks, folder, truth=case.friction, title=case.title, prefix=prefix)
