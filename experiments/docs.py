"""Bring the tables of results into pages of the documentation, between markers that name the experiment."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

__all__ = ["section", "write_docs"]


def section(record: Mapping[str, Any], tables: str) -> str:
    """Return the text between the markers of an experiment: how it was made, and its tables.

    Parameters
    ----------
    record : mapping
        Its manifest.
    tables : str
        In Markdown.
    """
    options = record["options"]
    command = f"{record['command']}{' --full' if options['full'] else ''}"
    how = f"`{command}`, seed {record['seed']}, {options['cells']} cells."
    return f"\n{how}\n\n{tables}\n"


def write_docs(place: Path, sections: Mapping[str, str]) -> None:
    """Replace the text between ``<!-- results: NAME -->`` and ``<!-- end -->`` by the section of NAME.

    Parameters
    ----------
    place : Path
        A page in Markdown, or a folder of them; experiments that have no marker there are left out.
    sections : mapping
        Of :func:`section`, by experiment.
    """
    for page in sorted(place.glob("*.md")) if place.is_dir() else [place]:
        text = page.read_text(encoding="utf-8")
        for name, new in sections.items():
            marker = re.compile(rf"(<!-- results: {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
            if found := marker.search(text):
                text = f"{text[: found.end(1)]}{new}{text[found.start(2) :]}"
        page.write_text(text, encoding="utf-8")
