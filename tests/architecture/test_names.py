"""Unit tests lie in a folder named like what they test; documents name files and sources that are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
UNIT = sorted((ROOT / "tests" / "unit").rglob("test_*.py"))
DOCUMENTS = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
FILE = re.compile(
    r"\b(?:tests|friction_bayes|experiments|paper_figures|benchmarks)/[\w/.-]+\.(?:py|toml|css)\b"
)
DOI = re.compile(r"\b10\.\d{4,5}/[\w./-]*\w")


@pytest.mark.parametrize("path", UNIT, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_unit_tests_mirror_the_package(path: Path) -> None:
    folder = path.parent.name
    home = "experiments" if folder == "experiments" else f"friction_bayes.{folder}"
    assert path.parents[1] == ROOT / "tests" / "unit"
    assert (ROOT / home.replace(".", "/")).is_dir()
    # the folder itself, or the public names
    assert re.search(
        rf"^(from|import) ({home}|friction_bayes)\b(?!\.)|^from {home}\.", path.read_text(), re.MULTILINE
    )


def test_documents_name_files_that_are_there() -> None:
    named = {
        (path.name, file) for path in DOCUMENTS for file in FILE.findall(path.read_text(encoding="utf-8"))
    }
    assert ("monitor.md", "tests/statistical/test_remaining_life.py") in named
    assert [each for each in sorted(named) if not (ROOT / each[1]).is_file()] == []


def test_sources_of_the_documents_are_in_the_bibliography() -> None:
    bibliography = (ROOT / "paper.bib").read_text(encoding="utf-8")
    entries = re.split(r"^(?=@)", bibliography, flags=re.MULTILINE)[1:]
    assert [entry for entry in entries if entry.count("{") != entry.count("}")] == []
    listed = set(re.findall(r"doi = \{([^}]+)\}", bibliography))
    cited = {doi for path in DOCUMENTS for doi in DOI.findall(path.read_text(encoding="utf-8"))}
    assert cited == listed
