"""Bring the tables of results into pages of the documentation, between markers that name the experiment."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path

__all__ = ["write_docs"]


def write_docs(place: Path, results: Path, names: Sequence[str]) -> None:
    """Replace what stands between ``<!-- results: NAME -->`` and ``<!-- end -->`` by the tables of NAME.

    Parameters
    ----------
    place : Path
        A page in Markdown, or a folder of them; experiments that have no marker there are left out.
    results : Path
        Folder with ``NAME.md`` and ``NAME.json``.
    names : sequence of str
        Experiments.
    """
    for page in sorted(place.glob("*.md")) if place.is_dir() else [place]:
        text = page.read_text(encoding="utf-8")
        page.write_text(_with_tables(text, results, names), encoding="utf-8")


def _with_tables(text: str, results: Path, names: Sequence[str]) -> str:
    for name in names:
        marker = re.compile(rf"(<!-- results: {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
        tables = (results / f"{name}.md").read_text(encoding="utf-8")
        record = json.loads((results / f"{name}.json").read_text(encoding="utf-8"))
        how = f"`{record['command']}`, seed {record['seed']}, {record['options']['cells']} cells."
        if found := marker.search(text):
            text = f"{text[: found.end(1)]}\n{how}\n\n{tables}\n{text[found.start(2) :]}"
    return text
