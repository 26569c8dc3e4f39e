"""Commands that must be refused: one line that names the place, and no traceback."""

from __future__ import annotations

import pytest

from friction_bayes.cli.program import main


def refused(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    """Run a command that must be refused, and return its one line."""
    status = main(argv)
    shown = capsys.readouterr()
    assert status == 2, shown.err
    assert shown.out == ""
    lines = shown.err.splitlines()
    assert len(lines) == 1, shown.err
    assert "Traceback" not in shown.err
    assert lines[0].startswith("friction-bayes: ")
    return lines[0]
