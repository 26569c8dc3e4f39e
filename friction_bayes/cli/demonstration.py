"""The demo: two synthetic records by every method, each with its emcee reference, and a closed loop.

The second record holds viscous damping, which no method knows of: the loop is closed on it, requests a
further release, and with that finds the damping.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import dask
import xarray as xr
from dask.callbacks import Callback
from rich.console import Console

import friction_bayes as fb
from friction_bayes.cli.console import collected_warnings, note, output_console, progress_bar
from friction_bayes.cli.loop_folder import write_loop
from friction_bayes.cli.options import options_of
from friction_bayes.cli.tables.estimate import comparison_table, disagreements
from friction_bayes.cli.tables.loop import loop_digest
from friction_bayes.core.files import manifest, output_folder, write_json, write_manifest
from friction_bayes.core.system import Oscillator
from friction_bayes.estimators.result import Estimate
from friction_bayes.mechanics.testbed import (
    PAPER_FRICTION,
    PAPER_SYSTEM,
    TESTBED,
    TESTBED_FRICTION,
    TESTBED_RELEASE,
    TESTBED_SPAN,
    paper_example,
)
from friction_bayes.plotting import save_figure
from friction_bayes.plotting.estimate import comparison_figures, joint_figure, signal_figures
from friction_bayes.reference.checking import ReferenceRun, check_estimate

__all__ = ["METHODS", "Case", "demonstrate"]

_DAMPING_RATIO = 0.001

METHODS = ("waveform", "envelope", "normal-gamma", "gamma-exponential")


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
    remark : str
        What to see in its table.
    further : xarray.DataArray or None
        A further release of a system that the loop is closed on, with which it is closed once more.
    """

    name: str
    title: str
    record: xr.DataArray
    system: Oscillator
    friction: float
    remark: str
    further: xr.DataArray | None = None


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """One method on one case, and what was warned of."""

    estimate: Estimate
    check: ReferenceRun
    warnings: tuple[str, ...]


def demonstrate(arguments: argparse.Namespace) -> None:
    """Make the records, estimate, check, close the loop, draw and print.

    Parameters
    ----------
    arguments : argparse.Namespace
        ``out``, ``force`` and ``seed``.
    """
    started = perf_counter()
    cases = _cases(arguments.seed)
    console = output_console()
    made = manifest("demo", options=options_of(arguments), seed=arguments.seed)
    with output_folder(arguments.out, force=arguments.force) as folder:
        outcomes = _all_outcomes(cases, arguments.seed)
        results = {}
        for case in cases:
            own = outcomes[case.name]
            _draw(case, own, folder)
            rows = [outcome.estimate.to_dict(outcome.check.summary) for outcome in own]
            results[case.name] = {"true_friction": case.friction, "estimates": rows}
            console.print(comparison_table(case.title, case.friction, rows))
            for line in disagreements(rows):
                console.print(line)
            console.print(f"{case.remark}\n", style="italic")
            if case.further is not None:
                _close_loop(case, case.further, arguments.seed, made, folder, console)
        write_json(folder / "demo.json", results)
        write_manifest(folder, made)
    for text in dict.fromkeys(text for own in outcomes.values() for each in own for text in each.warnings):
        note(text)
    console.print(f"{perf_counter() - started:.0f} s in all; figures and numbers are in {arguments.out}")


def _all_outcomes(cases: Sequence[Case], seed: int) -> dict[str, list[Outcome]]:
    """Run every method on every case, two processes at a time."""
    jobs = [(case, method) for case in cases for method in METHODS]
    with progress_bar() as bar:
        task = bar.add_task("closed forms and emcee", total=len(jobs))
        with Callback(posttask=lambda *_: bar.advance(task)):
            done = dask.compute(
                *(dask.delayed(_outcome, traverse=False)(case, method, seed) for case, method in jobs),
                scheduler="processes",
                num_workers=2,
                optimize_graph=False,
            )
    outcomes: dict[str, list[Outcome]] = {case.name: [] for case in cases}
    for (case, _), outcome in zip(jobs, done, strict=True):
        outcomes[case.name].append(outcome)
    return outcomes


def _outcome(case: Case, method: str, seed: int) -> Outcome:
    with collected_warnings() as warned:
        estimate = fb.estimate(case.record, case.system, method=method, random_force="none")
        check = check_estimate(estimate, seed=seed)
    return Outcome(estimate=estimate, check=check, warnings=tuple(warned))


def _close_loop(
    case: Case, further: xr.DataArray, seed: int, made: Mapping[str, Any], folder: Path, console: Console
) -> None:
    """Close the loop on a record, and on it with a further release; leave the page of the latter."""
    with progress_bar() as bar:
        task = bar.add_task("closing the loop", total=2)
        for title, records in (
            (f"The loop closed on {case.record.attrs['name']}", [case.record]),
            ("The same with a release from half the amplitude", [case.record, further]),
        ):
            report = fb.close_loop(records, case.system, seed=seed, reference_friction=case.friction)
            bar.advance(task)
            result = report.to_dict()
            console.print(loop_digest(title, result, len(records)))
            console.print()
    write_loop(report, result, made, folder)


def _testbed_release(seed: int, share: float, name: str) -> xr.DataArray:
    """A record of the testbed with viscous damping in it, released from a share of the usual amplitude."""
    return fb.simulate(
        TESTBED,
        friction=TESTBED_FRICTION,
        initial_displacement=share * TESTBED_RELEASE,
        duration=12.0,
        sampling_rate=1000.0,
        noise_sd=1e-4,
        bits=16,
        sensor_range=0.5 * TESTBED_SPAN,
        effects={"viscous_damping.damping_ratio": _DAMPING_RATIO},
        seed=seed,
        name=name,
    )


def _cases(seed: int) -> tuple[Case, Case]:
    return (
        Case(
            name="paper",
            title="The paper's numerical example",
            record=paper_example(seed),
            system=PAPER_SYSTEM,
            friction=PAPER_FRICTION,
            remark="Every closed form agrees with its sampler. The interval of the paper's normal-gamma is "
            "far too wide: successive friction samples share an amplitude; gamma-exponential estimates a "
            "rate, about 1 / friction, and the paper rejects it.",
        ),
        Case(
            name="testbed",
            title=f"Testbed with viscous damping {_DAMPING_RATIO:g} in it",
            record=_testbed_release(seed, 1.0, "testbed (synthetic)"),
            further=_testbed_release(seed + 1, 0.5, "half the amplitude (synthetic)"),
            system=TESTBED,
            friction=TESTBED_FRICTION,
            remark="All four models contain dry friction only and attribute the loss by viscous damping to "
            "it: closed form and sampler agree on a wrong model. A narrow interval does not prove the model.",
        ),
    )


def _draw(case: Case, outcomes: Sequence[Outcome], folder: Path) -> None:
    estimates = {outcome.estimate.method: outcome.estimate for outcome in outcomes}
    checks = {outcome.estimate.method: outcome.check for outcome in outcomes}
    figures = signal_figures(estimates["waveform"], case.record)
    figures["joint"] = joint_figure(estimates["normal-gamma"], truth=case.friction)
    figures |= comparison_figures(list(estimates.values()), checks, truth=case.friction, title=case.title)
    for name, figure in figures.items():
        save_figure(figure, folder, f"{case.name}_{name}")
