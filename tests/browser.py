"""A real browser for tests, where this machine has one; what drives it belongs to no extra."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

__all__ = ["BROWSER", "needs_browser", "opened"]

_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
BROWSER = next(filter(None, map(shutil.which, _BROWSERS)), None)

needs_browser = pytest.mark.skipif(BROWSER is None, reason=f"none of {', '.join(_BROWSERS)} is on the path")


@contextmanager
def opened(**settings: Any) -> Iterator[Any]:
    """Yield an empty page of the browser; skip where playwright, which drives it, is not installed.

    Parameters
    ----------
    **settings
        Of playwright's ``new_context``, such as ``viewport``.
    """
    reason = "driving a browser takes the package playwright"
    api = pytest.importorskip("playwright.sync_api", reason=reason)
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield browser.new_context(**settings).new_page()
        browser.close()
