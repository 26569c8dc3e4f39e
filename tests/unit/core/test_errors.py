"""Messages: options for the command line, arguments for Python."""

from __future__ import annotations

import pickle

import pytest

from friction_bayes.core.errors import InputError


@pytest.mark.parametrize(
    ("place", "remedy", "message"),
    [
        ("--start", "give 0 .. 3 s", "start: 9 s is outside; give 0 .. 3 s"),
        ("swing.csv", "take --end 3.9 or --start -4", "swing.csv: 9 s is outside; take end=3.9 or start=-4"),
        ("swing.csv", "by --sampling-rate HZ", "swing.csv: 9 s is outside; by sampling_rate=HZ"),
        ("swing.csv", "by --start and --end", "swing.csv: 9 s is outside; by start and end"),
        # which Python has not
        ("--out there", "add --force", "--out there: 9 s is outside; add --force"),
    ],
)
def test_python_reads_arguments_and_the_command_line_options(place: str, remedy: str, message: str) -> None:
    error = InputError(place, "9 s is outside", remedy)
    assert str(error) == message
    assert error.for_command_line == f"{place}: 9 s is outside; {remedy}"
    assert pickle.loads(pickle.dumps(error)).for_command_line == error.for_command_line
