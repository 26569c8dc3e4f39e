"""The site of the documentation: ``make docs``. It builds and reads without a network."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert

import friction_bayes as fb

project = "friction_bayes"
author = "The friction_bayes developers"
release = version = fb.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
# pages of examples/ are made from the gallery; its notebooks are downloads
exclude_patterns = ["gallery", "examples/*.ipynb"]
highlight_language = "none"  # a block without a name shows a terminal
html_theme = "furo"
html_title = f"friction_bayes {release}"
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False

myst_enable_extensions = ["dollarmath"]
# links within a page go by the headings, as where the pages are read as plain Markdown
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_timeout = 300
nb_execution_raise_on_error = True

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "examples",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "write_computation_times": False,
    "capture_repr": (),
}

templates_path = ["_templates"]
autodoc_typehints = "none"  # numpydoc has the types
numpydoc_show_class_members = False
# what is not public has no page
nitpick_ignore_regex = [("py:.*", r"friction_bayes(\.\w+){2,}")]
html_math_renderer = "mathml"


def _inline_math(translator: Any, node: nodes.math) -> None:
    translator.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _display_math(translator: Any, node: nodes.math_block) -> None:
    equation = convert(node.astext(), display="block")
    translator.body.append(f'<div tabindex="0" style="margin: 1rem 0; overflow-x: auto">{equation}</div>')
    raise nodes.SkipNode


def _link_within_site(app: Any, page: str, source: list[str]) -> None:
    """Keep links here and name them by titles; in a checkout they lead, and are named, by file."""
    text = source[0].replace("(../CONTRIBUTING.md", "(contributing.md")
    source[0] = re.sub(r"\[[\w-]+\.md\]\(", "[](", text)


_BARRIERS = {
    'role="heading">': 'role="heading" aria-level="2">',
    '<aside class="sidebar-drawer">': '<aside class="sidebar-drawer" aria-label="All pages">',
    '<aside class="toc-drawer': '<aside aria-label="On this page" class="toc-drawer',
    "<pre>": '<pre tabindex="0">',
    '<div class="table-wrapper': '<div tabindex="0" class="table-wrapper',
    '<span class="doc">': '<span class="doc" style="display: inline; color: transparent">',
}
"""What axe finds in the theme's pages: headings without a level, landmarks without a name, blocks that
scroll and that no key reaches, and links of the gallery whose text is hidden from readers."""


def _remove_barriers(app: Any, exception: Exception | None) -> None:
    """Mend the pages as they were written, of which the theme's templates make parts."""
    if exception is None:
        for page in Path(app.outdir).rglob("*.html"):
            text = page.read_text(encoding="utf-8")
            for found, mended in _BARRIERS.items():
                text = text.replace(found, mended)
            page.write_text(text, encoding="utf-8")


def setup(app: Any) -> None:
    """Let equations be MathML, which browsers draw by themselves, and pages work for keys and readers."""
    app.add_html_math_renderer("mathml", (_inline_math, None), (_display_math, None))
    app.connect("source-read", _link_within_site)
    app.connect("build-finished", _remove_barriers)
