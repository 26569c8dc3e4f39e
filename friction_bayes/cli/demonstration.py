"""The demo: two synthetic records, estimated by every method, each beside its emcee reference."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import dask
import xarray as xr
from dask.callbacks import Callback

import friction_bayes as fb
from friction_bayes.cli.console import collected_warnings, note, output_console, progress_bar
from friction_bayes.cli.options import options_of
from friction_bayes.cli.tables.estimate import comparison_table, disagreements
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
    """

    name: str
    title: str
    record: xr.DataArray
    system: Oscillator
    friction: float
    remark: str


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """One method on one case, and what was warned of."""

    estimate: Estimate
    check: ReferenceRun
    warnings: tuple[str, ...]


def demonstrate(arguments: argparse.Namespace) -> None:
    """Make both records, estimate, check, draw and print.

    Parameters
    ----------
    arguments : argparse.Namespace
        ``out``, ``force`` and ``seed``.
    """
    started = perf_counter()
    cases = _cases(arguments.seed)
    console = output_console()
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
        write_json(folder / "demo.json", results)
        write_manifest(folder, manifest("demo", options=options_of(arguments), seed=arguments.seed))
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
            record=fb.simulate(
                TESTBED,
                friction=TESTBED_FRICTION,
                initial_displacement=TESTBED_RELEASE,
                duration=12.0,
                sampling_rate=1000.0,
                noise_sd=1e-4,
                bits=16,
                sensor_range=0.5 * TESTBED_SPAN,
                effects={"viscous_damping.damping_ratio": _DAMPING_RATIO},
                seed=seed,
                name="testbed (synthetic)",
            ),
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
