"""One self-contained HTML page: no script, nothing loaded from elsewhere, same input, same bits."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined

from friction_bayes.core.text import interval90, listed, number, percent, set_words, words

__all__ = ["FigureInWords", "render_page", "reproduction"]


class FigureInWords(NamedTuple):
    """A figure in words.

    Attributes
    ----------
    shows : str
        What it shows, for who does not see it.
    caption : str
        How to read it.
    """

    shows: str
    caption: str


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


_FILTERS: dict[str, Callable[..., str]] = {
    "base64": _base64,
    "interval90": interval90,
    "listed": listed,
    "number": number,
    "percent": percent,
    "set_words": set_words,
    "words": words,
}


def render_page(template: str, **context: Any) -> str:
    """Fill a template of ``report/templates/``; whatever is put into it is escaped.

    Parameters
    ----------
    template : str
        File name.
    **context
        What the template names.
    """
    environment = Environment(
        loader=PackageLoader("friction_bayes.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(_FILTERS)
    return environment.get_template(template).render(context)


def reproduction(manifest: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and text of what is needed to make the result again."""
    options = {
        name: ", ".join(value) if isinstance(value, list) else value
        for name, value in manifest["options"].items()
        if value not in (None, False, []) and name not in ("out", "force", "json")
    }
    versions = {name: version for name, version in manifest["versions"].items() if version}
    seed = manifest["seed"]
    return [
        *([] if seed is None else [("seed", str(seed))]),
        *(
            (entry["record"], f"{name.replace('_', ' ')} {digest}")
            for entry in manifest["inputs"]
            for name, digest in entry.items()
            if name != "record"
        ),
        ("options", ", ".join(f"{name.replace('_', '-')} {value}" for name, value in options.items())),
        ("versions", ", ".join(f"{name} {version}" for name, version in versions.items())),
    ]
