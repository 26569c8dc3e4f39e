"""One self-contained HTML page: no script, nothing loaded from elsewhere, same input, same bits."""

from __future__ import annotations

import base64
from collections.abc import Callable
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from friction_bayes.core.text import listed, number, percent, set_words, words

__all__ = ["render_page"]


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


_FILTERS: dict[str, Callable[..., str]] = {
    "base64": _base64,
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
