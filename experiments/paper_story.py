"""The page on the paper's claims, its numbers quoted from the tables of the documentation.

``python -m experiments.paper_story [--docs DIR]`` fills the words of ``paper.md`` in this folder. What is
quoted is the text of a table's cell, so that page and tables cannot differ.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from experiments.paper_numbers import printed
from experiments.tables import markdown

__all__ = ["story", "write_story"]

TEMPLATE = Path(__file__).with_name("paper.md")
"""The words, with quotations in braces: ``{TABLES: ROW > COLUMN > PART}``.

``TABLES`` is an experiment, or ``paper_comparison``; ``ROW`` the first cell of a row, or cells that pick
it as ``column=cell; column=cell``; ``COLUMN`` is ``ours`` where it is left out; ``PART`` is one of
:data:`PARTS`. ``{paper: ID}`` is a number of the paper, ``{claims}`` the table of :data:`CLAIMS`.
"""
CLAIMS = {
    "precision 34.3 in our band": "section 3: precision",
    "its three errors, independent records": "section 3: its three errors together, independent records",
    "its three errors, one draw scaled": "section 3: its three errors together, one draw of noise scaled",
    "the RMSE lies in the 90 % interval of the precision": "section 3: the RMSE lies in the 90 % interval",
    "the 90 % region shrinks": "section 3: the 90 % region shrinks",
    "precision falls as noise grows": "section 3: precision falls from 20 to 14.7 to 8.6 dB",
    "Fig. 4: more precision, less error": "Fig. 4: precision and |error| as data come in",
    "the same across records of equal length": (
        "section 3: precision and |error| across records of equal length"
    ),
    "more precision with more periods (5.7, 11.6)": "section 4: precision higher on set 2 than on set 1",
    "more on the reduced set (32.2)": "section 4: precision higher on the reduced set",
    "Table 2: error grows to 10 Hz": "Table 2: |error| grows from 1 kHz to 10 Hz",
    "Table 2: precision falls to 10 Hz": "Table 2: precision falls from 1 kHz to 10 Hz",
    "1 kHz and 100 Hz practically the same": "Table 2: precisions at 100 Hz and 1 kHz within 10 %",
    "30 of its own 32.2 takes 100 Hz, refuses 10 Hz": (
        "Table 2: the run's own criterion takes 100 Hz and refuses 10 Hz"
    ),
    "precision is better than a coin as a criterion": "acceptance within 10 %: area, precision",
}
"""Claims of the paper as the page words them, and as :mod:`experiments.prior_claims` names them."""
CLAIM_COLUMNS = {
    "holds under": "ours > held",
    "of those of a mean above 32.2": "remark > restricted",
    "next to none": "next to none > verdict",
    "as drawn in our figures": "as drawn > verdict",
    "two samples, mean 5": "two samples, mean 5 > verdict",
    "38 samples, mean 125": "38 samples, mean 125 > verdict",
}
PAGE = "paper.md"
COMPARISON = "paper_comparison"
VERDICTS = re.compile(r" (yes|\*\*no\*\*|open)(?= /|$)")
PARTS: Mapping[str, Callable[[str], str]] = {
    "": lambda cell: cell,
    # without its band
    "median": lambda cell: re.sub(r"^precision | \[[^\]]*\]", "", cell),
    # without its unit
    "number": lambda cell: VERDICTS.sub("", re.sub(r" (N|%|kg|1/N\^2|1/N|m|m/s2|dB)$", "", cell)),
    "verdict": lambda cell: " / ".join(VERDICTS.findall(cell)),
    # of a remark, what its first words are
    "first": lambda cell: re.split(r"[;,] | within a condition", cell)[0],
    # of a remark, the range or the figure that it ends in
    "last": lambda cell: cell.rpartition(": ")[2],
    "refused": lambda cell: re.findall(r"refuses (\d+ %)", cell)[0],
    "negative": lambda cell: re.findall(r"(\d+ %) of the samples are negative", cell)[0],
    "mass": lambda cell: re.findall(r"[\d.]+ kg", cell)[0],
    # of "RMS error, coverage, width", and of a remark that begins "RMS 8 %;"
    "RMS": lambda cell: re.sub(r"^(error.*, )?RMS ", "", re.split(r"; |, covers", cell)[0]),
    "error": lambda cell: re.sub(r"^error ", "", cell.split(", RMS")[0]),
    "covers": lambda cell: re.split(r"covers |contains the truth in ", cell)[1].split(";")[0].split(",")[0],
    "accepted": lambda cell: re.findall(r"accepted ([^()]+) \(", cell)[0],
    # of a count of priors, those that hold
    "held": lambda cell: re.sub(r" \(\+\d+\)", "", cell),
    "counts": lambda cell: re.sub(r" \(\+\d+\)| of \d+$", "", cell),
    "restricted": lambda cell: cell.split(" with ")[0].replace(" the ", " "),
}


def _rows(text: str) -> list[dict[str, str]]:
    """Every row of the tables in a text, by column heading."""
    found: list[dict[str, str]] = []
    heading: list[str] | None = None
    for line in text.splitlines():
        if not line.startswith("| "):
            heading = None
            continue
        cells = [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if heading is None:
            heading = cells
        elif set(cells[0]) != {"-"}:
            found.append(dict(zip(heading, cells, strict=True)))
    return found


def _tables(docs: Path) -> dict[str, list[dict[str, str]]]:
    """Rows by experiment, of all pages; and of the page that compares numbers."""
    marked = re.compile(r"<!-- results: (\S+) -->\n(.*?)<!-- end -->", re.DOTALL)
    texts = {page.stem: page.read_text(encoding="utf-8") for page in docs.glob("*.md")}
    found = {name: _rows(table) for text in texts.values() for name, table in marked.findall(text)}
    return found | {COMPARISON: _rows(texts.get(COMPARISON, ""))}


def _quoted(quotation: str, tables: Mapping[str, Sequence[Mapping[str, str]]]) -> str:
    name, _, place = quotation.partition(": ")
    if name == "paper":
        return f"{printed(place):g}"
    row, *rest = place.split(" > ")
    column, part = (*rest, *("ours", "")[len(rest) :])
    picked = [each for each in tables.get(name, ()) if column in each and _is(each, row)]
    if len(picked) != 1:
        raise ValueError(f"{{{quotation}}}: {len(picked)} rows with a column {column!r}, not one")
    return PARTS[part](picked[0][column])


def _is(row: Mapping[str, str], wanted: str) -> bool:
    if next(iter(row.values())) == wanted:
        return True
    pairs = [pair.partition("=") for pair in wanted.split("; ")]
    return all(mark and row.get(column) == cell for column, mark, cell in pairs)


def story(docs: Path, words: str | None = None) -> str:
    """Return the page in Markdown.

    Parameters
    ----------
    docs : Path
        Folder of pages with the tables.
    words : str, optional
        The template, for that of this module.

    Raises
    ------
    ValueError
        If a quotation does not name one cell.
    """
    tables = _tables(docs)
    text = TEMPLATE.read_text(encoding="utf-8") if words is None else words
    claims = markdown(
        [
            {"claim of the paper": says}
            | {head: f"{{prior_sweep: {claim} > {cell}}}" for head, cell in CLAIM_COLUMNS.items()}
            for says, claim in CLAIMS.items()
        ]
    )
    text = text.replace("{claims}\n", claims.replace("\\|", "|"))
    return re.sub(r"\{([a-z_]+: [^{}]+)\}", lambda found: _quoted(found[1], tables), text)


def write_story(docs: Path) -> None:
    """Write the page into the folder of the documentation."""
    (docs / PAGE).write_text(story(docs), encoding="utf-8")


def main(argv: Sequence[str] | None = None) -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(prog="python -m experiments.paper_story", description=__doc__)
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="folder (default %(default)s)")
    write_story(parser.parse_args(argv).docs)


if __name__ == "__main__":
    main()
