"""Estimates as tables: one, several records, or several estimators of one record side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group
from rich.table import Table
from rich.text import Text

from friction_bayes.cli.tables.layout import two_columns
from friction_bayes.core.text import duration, interval90, number, with_interval

__all__ = ["comparison_table", "disagreements", "estimate_table", "records_table"]

_VERDICTS = {
    True: "agrees with the closed form",
    False: "DOES NOT AGREE with the closed form",
    None: "NOT JUDGED against the closed form",
}
_MARKS = {
    True: Text("yes"),
    False: Text("NO", style="bold red"),
    None: Text("not judged", style="bold yellow"),
}


def _frequency(result: Mapping[str, Any]) -> str:
    frequency = result["frequency"]
    spread = "" if frequency["sd"] is None else f" ± {number(frequency['sd'], 2)}"
    return f"{number(frequency['mean'], 6)}{spread} rad/s, declared {number(frequency['declared'], 6)} rad/s"


def _random_force(force: Mapping[str, Any]) -> str:
    return (
        f"probability {number(force['probability'], 2)}; if there, sd {with_interval(force['sd'], 2)}, "
        f"{force['share_of_friction']:.0%} of friction, over {number(force['correlation_time']['mean'], 2)} s"
    )


def _reference(reference: Mapping[str, Any]) -> str:
    trust = "" if reference["converged"] else "NOT CONVERGED: "
    lines = [
        f"{with_interval(reference['friction'])}, {reference['checked']}",
        f"{trust}R-hat {reference['rhat']:.4f}, effective sample size {reference['ess_bulk']:.0f}",
        f"{_VERDICTS[reference['agrees']]} (false-alarm rate {reference['false_alarm_rate']:.0%}); "
        f"means {_apart(reference)} sd apart",
        f"took {duration(reference['sampler_s'])}",
    ]
    if not reference["agrees"]:
        lines.insert(3, reference["because"])
    return "\n".join(lines)


def _apart(reference: Mapping[str, Any]) -> str:
    """Distance of the two means in posterior sd, which shows whether a disagreement matters."""
    difference = reference["difference_in_sd"]
    return "–" if difference is None else f"{abs(difference):.2f}"


def estimate_table(result: Mapping[str, Any], read: str | None = None) -> Table:
    """Lay out one estimate, as :meth:`Estimate.to_dict` gives it.

    Parameters
    ----------
    result : mapping
        The estimate, its ``reference`` included where one was sampled.
    read : str, optional
        What was understood of the file.
    """
    table = two_columns(f"{result['record']}, {result['method']}")
    if read is not None:
        table.add_row("read", Text(read))
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
        table.add_row("noise per sample", f"sd {number(noise['mean'])} {noise['unit']}")
    if result["random_force"] is not None:
        table.add_row("random force", _random_force(result["random_force"]))
    rest = result["rest_position"]
    table.add_row("rest position", f"{number(rest['mean'])} {rest['unit']}")
    table.add_row("amplitudes", str(result["amplitudes"]))
    if result["reference"] is not None:
        table.add_row("emcee", _reference(result["reference"]))
    for text in result["notes"]:
        table.add_row("note", Text(text))
    return table


def records_table(results: Sequence[Mapping[str, Any]], read: Sequence[str]) -> Group:
    """Lay out estimates of several records, a row a record, with the numbers of the notes below.

    Parameters
    ----------
    results : sequence of mapping
        Estimates as :meth:`Estimate.to_dict` gives them.
    read : sequence of str
        What was understood of each file.
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
    below = two_columns()
    for text in read:
        below.add_row("read", Text(text))
    for i, text in enumerate(notes, start=1):
        below.add_row(f"note {i}", Text(text))
    return Group(table, below)


def comparison_table(title: str, truth: float, rows: Sequence[Mapping[str, Any]]) -> Table:
    """Lay out estimators of one record side by side, each beside its reference run.

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
            _MARKS[reference["agrees"]] + f" {_apart(reference)}",
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
            f"{row['method']}: {_VERDICTS[row['reference']['agrees']]}: {row['reference']['because']}",
            style="red",
        )
        for row in rows
        if not row["reference"]["agrees"]
    ]


def _percent(share: float) -> str:
    return f"{share:+.2%}" if abs(share) < 1.0 else f"x {1.0 + share:.0f}"
