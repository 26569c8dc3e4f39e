"""Messages: options for the command line, arguments for Python."""

from __future__ import annotations

import pickle

import pytest

from friction_bayes.core.errors import InputError, RecordWarning


@pytest.mark.parametrize(
    ("place", "remedy", "message"),
    [
        ("--start", "give 0 .. 3 s", "start: 9 s is outside; give 0 .. 3 s"),
        ("swing.csv", "take --end 3.9 or --start -4", "swing.csv: 9 s is outside; take end=3.9 or start=-4"),
        ("swing.csv", "by --sampling-rate HZ", "swing.csv: 9 s is outside; by sampling_rate=HZ"),
        ("swing.csv", "by --start and --end", "swing.csv: 9 s is outside; by start and end"),
        ("--inertia", "declare --inertia for angles", "inertia: 9 s is outside; declare inertia for angles"),
        (
            "swing.csv",
            "choose one by --decay N, each by --decay all, or use close-loop",
            "swing.csv: 9 s is outside; choose one by split_decays(record, system)[N - 1], each by "
            "split_decays(record, system), or use close_loop",
        ),
        # names of files are theirs
        ("close-loop/a--start.csv", "remove it", "close-loop/a--start.csv: 9 s is outside; remove it"),
    ],
)
def test_python_reads_arguments_and_the_command_line_options(place: str, remedy: str, message: str) -> None:
    error = InputError(place, "9 s is outside", remedy)
    assert str(error) == message
    assert error.for_command_line == f"{place}: 9 s is outside; {remedy}"
    assert pickle.loads(pickle.dumps(error)).for_command_line == error.for_command_line


def test_warnings_have_arguments_in_python_and_options_on_the_command_line() -> None:
    warning = RecordWarning("noise alone after 3 s: --end 3 leaves it out; close-loop looks for more")
    assert str(warning) == "noise alone after 3 s: end=3 leaves it out; close_loop looks for more"
    assert "--end 3" in warning.for_command_line
