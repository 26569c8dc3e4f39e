"""The page of the documentation with every number of the paper and ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from experiments.tables import markdown
from friction_bayes.mechanics.testbed import TESTBED

__all__ = ["CHOSEN", "OTHER", "by_chance", "comparison_page", "counted", "own_results", "smaller_errors"]

CHOSEN, OTHER = "normal-gamma, highest", "normal-gamma, nominal"
"""The reading of "peak" that is judged by, and the other: the highest sample of a period; where it is due."""

VERDICTS = ("in", "out", "undecided")
BAND = 0.9
"""Share of our records within a band."""

HEAD = """# The paper's numbers and ours

Written by `python -m experiments --from-archive --docs docs` from `archive/`; do not edit. The story is in
[paper.md](paper.md).

**How it is judged.** The paper does not say how it picks a peak. One reading is judged by, *the highest
sample of each period*: that is what "peak" means in a sampled signal, and this package's default. It was
chosen after numbers of both readings had been seen; the other, *the sample where the peak is due*
(nominal), is next to it. *Ours* is the median over the records of synthetic data, with the band that
contains 90 % of them and the Monte Carlo error of its edges. The verdict is `in` or `out` of that band, and
`undecided` where an edge is nearer to the paper's number than the edge's own error. The band is two-sided
for errors too, so that one much smaller than ours is `out`: a one-sided rule would call it `in`. A number
that restates another (the error of a friction that is printed too, the same number again) is judged but
not counted. Nothing was tuned to agree.
"""


def counted(rows: Sequence[Mapping[str, Any]], reading: str, *, without: str | None = None) -> dict[str, int]:
    """Return how many of the paper's results of their own get each verdict by a reading of "peak".

    Parameters
    ----------
    rows : sequence of mappings
        Of :func:`experiments.paper_comparison.compare_with_paper`.
    reading : str
        :data:`CHOSEN` or :data:`OTHER`; a number that does not depend on it counts in both.
    without : str, optional
        Quantity that the paper does not state: numbers that scale with it are left out.
    """
    own = [_of(row, reading) for row in own_results(rows) if without is None or row["scales_with"] != without]
    return {word: sum(each["verdict"] == word for each in own) for word in VERDICTS}


def own_results(rows: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the rows of numbers that the paper computed and that restate no other."""
    return [row for row in rows if row["kind"] == "result" and not row["restates"]]


def by_chance(number: int) -> str:
    """Return how many of so many numbers fall outside our bands by chance, were all else right."""
    return f"{(1.0 - BAND) * number:.1f}"


def smaller_errors(rows: Sequence[Mapping[str, Any]], reading: str) -> list[str]:
    """Return which of the paper's errors, of their own, are ``out`` for being smaller than ours."""
    return [
        f"{row['paper']:g} {row['unit']}"
        for row in own_results(rows)
        if _of(row, reading).get("smaller_error")
    ]


def _of(row: Mapping[str, Any], reading: str) -> Mapping[str, Any]:
    """Our result of a row by a reading, or its only one."""
    ours: Mapping[str, Mapping[str, Any]] = row["ours"]
    return ours[reading] if reading in ours else next(iter(ours.values()))


def comparison_page(comparison: Mapping[str, Any]) -> str:
    """Return the comparison as a page of Markdown.

    Parameters
    ----------
    comparison : mapping
        Of :func:`experiments.paper_comparison.compare_with_paper`.
    """
    rows = comparison["rows"]
    results, inputs, criteria = (
        [row for row in rows if row["kind"] == kind] for kind in ("result", "input", "criterion")
    )
    own = own_results(rows)
    free = [row for row in own if row["scales_with"] != "mass"]
    records = min(each["records"] for row in own for each in row["ours"].values())
    sampled = [each["emcee"] for row in rows for each in row["ours"].values() if each["emcee"]]
    parts = [
        HEAD,
        "## What the paper computed\n",
        f"{len(results)} numbers, of which {len(results) - len(own)} restate others. Of the {len(own)} "
        f"of their own, by {_counts(rows)}; each over at least {records} records. Were all else right, "
        f"{by_chance(len(own))} of {len(own)} would be out of a 90 % band by chance. {len(own) - len(free)} "
        f"are precisions of the testbed, which go as 1/mass^2 with {TESTBED.moving:g} kg taken here; of the "
        f"other {len(free)}, by {_counts(rows, without='mass')} ({by_chance(len(free))} by chance). Out for "
        f"an error smaller than ours: {_smaller(rows)}. *emcee* is its value for the "
        "closed form's, means over the records that were sampled, by the same likelihood and prior"
        f"{_diagnostics(sampled)}.\n",
        _results_table(results),
        "## What goes into our data\n",
        "What the paper's data are: put into the simulation, what we chose something for, or what follows "
        "from that (every signal-to-noise ratio). That the data give them back checks our simulation and "
        "is no check of the paper.\n",
        _inputs_table(inputs),
        "## What the paper judges by\n",
        _criteria_table(criteria),
    ]
    return "\n".join(parts)


def _counts(rows: Sequence[Mapping[str, Any]], without: str | None = None) -> str:
    return "; ".join(
        f"{name}: " + ", ".join(f"{n} {word}" for word, n in counted(rows, reading, without=without).items())
        for name, reading in (("highest", CHOSEN), ("nominal", OTHER))
    )


def _smaller(rows: Sequence[Mapping[str, Any]]) -> str:
    named = {name: smaller_errors(rows, each) for name, each in (("highest", CHOSEN), ("nominal", OTHER))}
    return "; ".join(f"{name} {', '.join(found) or 'none'}" for name, found in named.items())


def _diagnostics(sampled: Sequence[Mapping[str, float]]) -> str:
    if not sampled:
        return ""
    records = min(each["records"] for each in sampled)
    rhat = max(each["nested_rhat"] for each in sampled)
    bulk, tail = (min(each[name] for each in sampled) for name in ("ess_bulk", "ess_tail"))
    return (
        f" (at least {records}; nested R-hat over four ensembles at most {rhat:.4f}, effective sample size "
        f"at least {bulk:.0f} in the bulk and {tail:.0f} in the tails)"
    )


def _results_table(rows: Sequence[Mapping[str, Any]]) -> str:
    lines = []
    for row in rows:
        mine, other = _of(row, CHOSEN), row["ours"].get(OTHER)
        lines.append(
            _stated(row)
            | {
                "ours, highest": _band(row, mine),
                "verdict": f"**{mine['verdict']}**",
                "emcee": _sampled(mine["emcee"]),
                "ours, nominal": "" if other is None else _band(row, other),
                "verdict (nominal)": "" if other is None else str(other["verdict"]),
                "restates": row["restates"],
                "note": row["note"],
            }
        )
    return markdown(lines)


def _inputs_table(rows: Sequence[Mapping[str, Any]]) -> str:
    return markdown(
        [
            _stated(row)
            | {
                "read back": "; ".join(_band(row, each) for each in row["ours"].values()) or "as stated",
                "note": row["note"],
            }
            for row in rows
        ]
    )


def _criteria_table(rows: Sequence[Mapping[str, Any]]) -> str:
    return markdown(
        [
            _stated(row)
            | {"ours, highest": _band(row, _of(row, CHOSEN))}
            | {"ours, nominal": _band(row, row["ours"][OTHER]) if OTHER in row["ours"] else ""}
            | {"note": row["note"]}
            for row in rows
        ]
    )


def _stated(row: Mapping[str, Any]) -> dict[str, str]:
    return {
        "number": row["id"],
        "where": row["place"],
        "the paper's words": f"“{row['text']}”" if row["text"] else "",
        "paper": f"{row['paper']:g}{_unit(row)}",
    }


def _unit(row: Mapping[str, Any]) -> str:
    return "" if row["unit"] == "1" else f" {row['unit']}"


def _band(row: Mapping[str, Any], ours: Mapping[str, Any]) -> str:
    """Median and band, each edge of a verdict with its Monte Carlo error."""
    if ours["records"] == 1:
        return f"{ours['median']:.3g}{_unit(row)}"
    low, high = f"{ours['low']:.4g}", f"{ours['high']:.4g}"
    if ours["verdict"] is not None:
        # one digit, not as 3e+01
        errors = (float(f"{ours[f'{edge}_error']:.1g}") for edge in ("low", "high"))
        low, high = (f"{edge} ± {error:g}" for edge, error in zip((low, high), errors, strict=True))
    return f"{ours['median']:.4g} [{low}, {high}]{_unit(row)}"


def _sampled(emcee: Mapping[str, float] | None) -> str:
    return "" if emcee is None else f"{emcee['value']:.4g} for {emcee['closed_form']:.4g}"
