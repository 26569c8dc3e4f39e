"""One self-contained HTML page: no script, nothing loaded from elsewhere, same input, same bits."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from importlib.resources import files

__all__ = ["figure_block", "page", "pairs", "paragraphs", "section", "table", "tiles"]


def page(title: str, *blocks: str) -> str:
    """Put blocks into a page."""
    style = files("friction_bayes.report").joinpath("page.css").read_text(encoding="utf-8")
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    body = "\n".join(blocks)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n</body>\n</html>\n"
    )


def section(heading: str, *blocks: str, folded: bool = False) -> str:
    """Put blocks under a heading; folded ones open at a click."""
    body = "\n".join(blocks)
    if folded:
        return f"<details>\n<summary>{escape(heading)}</summary>\n{body}\n</details>"
    return f"<section>\n<h2>{escape(heading)}</h2>\n{body}\n</section>"


def paragraphs(text: str, kind: str = "") -> str:
    """Escape a text, one paragraph a line."""
    opened = f'<p class="{kind}">' if kind else "<p>"
    return "\n".join(f"{opened}{escape(line)}</p>" for line in text.splitlines())


def tiles(items: Sequence[tuple[str, str, str]]) -> str:
    """Lay out the figures that matter most: label, value and a remark each."""
    cells = [
        f'<div class="tile"><span class="label">{escape(label)}</span>'
        f'<span class="value">{escape(value)}</span><span class="remark">{escape(remark)}</span></div>'
        for label, value, remark in items
    ]
    return '<div class="tiles">\n' + "\n".join(cells) + "\n</div>"


def table(headings: Sequence[str], rows: Sequence[Sequence[str]], marked: Sequence[bool] = ()) -> str:
    """Lay out a table; marked rows stand out."""
    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    lines = []
    for i, row in enumerate(rows):
        kind = ' class="marked"' if i < len(marked) and marked[i] else ""
        cells = "".join(f"<td>{escape(cell)}</td>" for cell in row)
        lines.append(f"<tr{kind}>{cells}</tr>")
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n" + "\n".join(lines) + "\n</tbody>\n</table>"


def pairs(rows: Sequence[tuple[str, str]]) -> str:
    """Lay out labels and texts."""
    lines = [f"<tr><td>{escape(label)}</td><td>{escape(text)}</td></tr>" for label, text in rows]
    return '<table class="pairs">\n<tbody>\n' + "\n".join(lines) + "\n</tbody>\n</table>"


def figure_block(svg: bytes, text: str) -> str:
    """Embed a figure with its caption."""
    data = base64.b64encode(svg).decode("ascii")
    return (
        f'<figure>\n<img alt="{escape(text, quote=True)}" src="data:image/svg+xml;base64,{data}">\n'
        f"<figcaption>{escape(text)}</figcaption>\n</figure>"
    )
