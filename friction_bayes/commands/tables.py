"""Results as tables to read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

__all__ = ["estimate_table", "with_interval"]


def number(value: float | None, digits: int = 4) -> str:
    """Write a number to some significant digits; a dash where there is none."""
    return "–" if value is None else f"{value:.{digits}g}"


def with_interval(summary: Mapping[str, Any], digits: int = 5) -> str:
    """Write mean, standard deviation and 90 % interval of a summary."""
    low, high = summary["interval90"]
    return (
        f"{number(summary['mean'], digits)} {summary['unit']}   sd {number(summary['sd'], 2)}   "
        f"90 %: {number(low, digits)} .. {number(high, digits)}"
    )


def _frequency(result: Mapping[str, Any]) -> str:
    frequency = result["frequency"]
    spread = "" if frequency["sd"] is None else f" ± {number(frequency['sd'], 2)}"
    return f"{number(frequency['mean'], 6)}{spread} rad/s, declared {number(frequency['declared'], 6)} rad/s"


def _reference(reference: Mapping[str, Any]) -> str:
    verdict = "agrees with the closed form" if reference["agrees"] else "DOES NOT AGREE with the closed form"
    return f"{with_interval(reference['friction'])}\n{verdict}; {reference['because']}"


def estimate_table(result: Mapping[str, Any]) -> Table:
    """Lay out one estimate, as :meth:`Estimate.to_dict` gives it.

    Parameters
    ----------
    result : mapping
        The estimate, its ``reference`` included where one was sampled.
    """
    table = Table.grid(padding=(0, 3))
    table.title = Text(f"{result['record']}, {result['method']}", style="bold")
    table.title_justify = "left"
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")

    table.add_row("friction", Text(with_interval(result["friction"]), style="bold"))
    table.add_row("friction / stiffness", with_interval(result["friction_over_stiffness"]))
    table.add_row("P(friction < 0)", number(result["probability_negative"], 2))
    if result["precision"] is not None:
        table.add_row("precision", with_interval(result["precision"], 4))
    if result["acceptance"] is not None:
        word = "yes" if result["accepted"] else "NO"
        table.add_row("accepted", f"{word}: {result['acceptance']['because']}")
    table.add_row("frequency", _frequency(result))
    if result["noise_sd"]["mean"] is not None:
        noise = result["noise_sd"]
        table.add_row("noise of a sample", f"sd {number(noise['mean'])} {noise['unit']}")
    rest = result["rest_position"]
    table.add_row("rest position", f"{number(rest['mean'])} {rest['unit']}")
    table.add_row("amplitudes", str(result["amplitudes"]))
    if result["reference"] is not None:
        table.add_row("emcee", _reference(result["reference"]))
    for text in result["notes"]:
        table.add_row("note", Text(text))
    return table
