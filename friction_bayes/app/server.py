"""The server of the page: this computer alone reaches it, and what was dropped goes when it ends."""

from __future__ import annotations

import errno
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any

import panel as pn
from panel.theme import DefaultTheme

from friction_bayes.app.fields import STYLE
from friction_bayes.app.page import Page
from friction_bayes.core.errors import InputError

__all__ = ["HOST", "serve"]

HOST = "127.0.0.1"
_MAIN = "{% extends base %}{% block contents %}<main>{{ embed(roots.page) }}</main>{% endblock %}"
"""The one landmark that a reader of the screen goes to."""


def serve(port: int, announce: Callable[[str], object]) -> None:
    """Serve the page until interrupted.

    Parameters
    ----------
    port : int
        Zero for any that is free.
    announce : callable
        Takes the address, once it answers.

    Raises
    ------
    InputError
        If there is no such port, or it is in use.
    """
    # its scripts and styles come with the package, and are served from there
    colours = Path(DefaultTheme.base_css).read_text(encoding="utf-8")
    # a template of one's own has none of the theme's, and buttons without them are white on white
    pn.extension("filedropper", raw_css=[colours, STYLE])
    with TemporaryDirectory(prefix="friction-bayes-") as folder:

        def visited() -> Any:
            page = Page(Path(mkdtemp(dir=folder)))
            pn.state.on_session_destroyed(lambda _: page.close())
            template = pn.Template(_MAIN)
            template.add_panel("page", page.view)
            return template

        try:
            server = pn.serve(
                visited,
                port=port,
                address=HOST,
                title="friction-bayes",
                show=False,
                start=False,
                verbose=False,
            )
        except OSError as error:
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise
            raise InputError(f"--port {port}", "is in use or may not be used", "give another") from None
        announce(f"http://{HOST}:{server.port}")
        server.start()
        with suppress(KeyboardInterrupt):
            server.io_loop.start()
