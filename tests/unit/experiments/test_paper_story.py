"""The page on the paper quotes the tables of the documentation, and is what they make it."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.paper_story import story

DOCS = Path(__file__).parents[3] / "docs"
PAGE = """<!-- results: sweep -->

| what | ours | remark |
| --- | --- | --- |
| size \\|e\\| | 3 [1, 6] % | RMS 4 %; more |

| rate | method | error % |
| --- | --- | --- |
| 10 | one | -1 [-2, 0] |
| 10 | two | -3 [-5, 1] |

<!-- end -->
"""


def quoted(words: str, docs: Path) -> str:
    (docs / "page.md").write_text(PAGE, encoding="utf-8")
    return story(docs, words)


def test_page_stands_as_its_tables_have_it() -> None:
    assert (DOCS / "paper.md").read_text(encoding="utf-8") == story(DOCS), (
        "python -m experiments.paper_story writes it again"
    )


def test_a_cell_is_quoted_by_row_and_column(tmp_path: Path) -> None:
    words = "{sweep: size |e|}, {sweep: size |e| > ours > median}, {sweep: size |e| > remark > RMS}"
    assert quoted(words, tmp_path) == "3 [1, 6] %, 3 %, 4 %"
    assert quoted("{sweep: rate=10; method=two > error %}", tmp_path) == "-3 [-5, 1]"
    assert quoted("{paper: example-precision}", tmp_path) == "34.3"


@pytest.mark.parametrize("words", ["{sweep: no such row}", "{sweep: rate=10 > error %}", "{other: size |e|}"])
def test_a_quotation_of_no_cell_or_of_several_is_an_error(words: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not one"):
        quoted(words, tmp_path)
