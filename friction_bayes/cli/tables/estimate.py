"""Estimates as tables: one, several records, or several estimators of one record side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group
from rich.table import Table
from rich.text import Text

from friction_bayes.cli.tables.layout import two_columns
from friction_bayes.core.text import duration, interval90, number
from friction_bayes.report.estimate_story import JUDGEMENTS, apart, estimate_story

__all__ = ["comparison_table", "disagreements", "estimate_table", "records_table"]

_MARKS = {
    True: Text("yes"),
    False: Text("NO", style="bold red"),
    None: Text("not judged", style="bold yellow"),
}


def estimate_table(
    result: Mapping[str, Any], heading: Sequence[tuple[str, str]] = (), *, notes: int | None = None
) -> Table:
    """Lay out one estimate, as :meth:`Estimate.to_dict` gives it.

    Parameters
    ----------
    result : mapping
        The estimate, its ``reference`` included where one was sampled.
    heading : sequence of tuple of str
        Labels and what is to be seen before the number: what was understood of the file, and warnings, which
        are not repeated among the notes.
    notes : int, optional
        How many notes to print at most.
    """
    table = two_columns(f"{result['record']}, {result['method']}")
    for label, text in heading:
        table.add_row(label, Text(text, style="yellow" if label == "warning" else ""))
    warned = [text for label, text in heading if label == "warning"]
    unsaid = {**result, "notes": [text for text in result["notes"] if text not in warned]}
    for label, text in estimate_story(unsaid, notes):
        table.add_row(label, Text(text, style="bold" if label == "friction" else ""))
    return table


def records_table(
    results: Sequence[Mapping[str, Any]], headings: Sequence[Sequence[tuple[str, str]]]
) -> Group:
    """Lay out estimates of several records, a row a record, with the numbers of the notes below.

    Parameters
    ----------
    results : sequence of mapping
        Estimates as :meth:`Estimate.to_dict` gives them.
    headings : sequence of sequence of tuple of str
        Of each record, as :func:`estimate_table` takes them: warnings above the table, the rest below it.
    """
    table = Table(box=SIMPLE_HEAD, padding=(0, 2, 0, 0), pad_edge=False)
    table.add_column("record", overflow="fold")
    for heading in ("friction", "90 % interval", "frequency\n[rad/s]"):
        table.add_column(Text(heading), justify="right", no_wrap=True)
    table.add_column("note", no_wrap=True)
    notes = list(dict.fromkeys(text for result in results for text in result["notes"]))
    for result in results:
        friction = result["friction"]
        numbers = (str(i) for i, text in enumerate(notes, start=1) if text in result["notes"])
        table.add_row(
            Text(result["record"]),
            f"{number(friction['mean'])} {friction['unit']}",
            interval90(friction),
            number(result["frequency"]["mean"], 5),
            ", ".join(numbers),
        )
    above, below = two_columns(), two_columns()
    labelled = [
        (result["record"], *row) for result, rows in zip(results, headings, strict=True) for row in rows
    ]
    for name, label, said in labelled:
        text = said if name in said else f"{name}: {said}"
        if label == "warning":
            above.add_row(label, Text(text, style="yellow"))
        else:
            below.add_row(label, Text(text))
    for i, text in enumerate(notes, start=1):
        below.add_row(f"note {i}", Text(text))
    return Group(*([above] if above.row_count else []), table, below)


def comparison_table(title: str, truth: float, rows: Sequence[Mapping[str, Any]]) -> Table:
    """Lay out estimators of one record side by side, each with its reference run.

    Parameters
    ----------
    title : str
        What the record is.
    truth : float
        True friction.
    rows : sequence of mapping
        Estimates as :meth:`Estimate.to_dict` gives them, with their ``reference``.
    """
    unit = rows[0]["friction"]["unit"]
    table = Table(
        title=f"{title}; true friction {truth:g} {unit}",
        title_justify="left",
        title_style="bold",
        box=SIMPLE_HEAD,
        padding=(0, 2, 0, 0),
        pad_edge=False,
    )
    table.add_column("method", no_wrap=True)
    for heading in (
        f"friction\n[{unit}]",
        "90 % interval",
        "error",
        "emcee\nmean",
        "R-hat",
        "ESS",
        "agrees,\nsd apart",
        "emcee\ntook",
    ):
        table.add_column(Text(heading), justify="right", no_wrap=True)
    for row in rows:
        friction, reference = row["friction"], row["reference"]
        table.add_row(
            row["method"],
            number(friction["mean"]),
            interval90(friction),
            _percent(friction["mean"] / truth - 1.0),
            number(reference["friction"]["mean"]),
            f"{reference['rhat']:.4f}",
            f"{reference['ess_bulk']:.0f}",
            _MARKS[reference["agrees"]] + f" {apart(reference)}",
            duration(reference["sampler_s"]),
        )
    return table


def disagreements(rows: Sequence[Mapping[str, Any]]) -> list[Text]:
    """Give the reason for each estimate that its reference run contradicts or cannot judge.

    Parameters
    ----------
    rows : sequence of mapping
        As for :func:`comparison_table`.
    """
    return [
        Text(
            f"{row['method']}: {JUDGEMENTS[row['reference']['agrees']]}: {row['reference']['because']}",
            style="red",
        )
        for row in rows
        if not row["reference"]["agrees"]
    ]


def _percent(share: float) -> str:
    return f"{100.0 * share:+.2f} %" if abs(share) < 1.0 else f"x {1.0 + share:.0f}"
