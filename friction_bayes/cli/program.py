"""The command line: parser, dispatch, and how errors are reported."""

from __future__ import annotations

import argparse
import gc
import os
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

import friction_bayes as fb
from friction_bayes.cli.commands import COMMANDS
from friction_bayes.cli.options import one_value_each
from friction_bayes.core.checks import not_a_number
from friction_bayes.core.errors import InputError, did_you_mean

__all__ = ["build_parser", "command", "main"]

_COMPLETING = "_ARGCOMPLETE"
"""Set by the code of ``friction-bayes completion`` while a line is typed."""
_DEBUG = "FRICTION_BAYES_DEBUG"
_COLLECTED_AFTER = 200_000
"""New objects after which Python looks for dead ones that refer to each other; all others it frees at once.
A command loads hundreds of thousands of objects that live as long as it does: with Python's own threshold of
one or two thousand it spends a tenth of its time on looking through them."""
_EPILOG = """examples:
  friction-bayes demo
  friction-bayes simulate --mass 10 --stiffness 1000 --friction 0.07 --out decay.csv
  friction-bayes estimate decay.csv --mass 10 --stiffness 1000 --check
  friction-bayes estimate dataset:map-single-pendulum --json
  friction-bayes close-loop decay.csv --mass 10 --stiffness 1000 --out loop

exit status: 0 done; 2 bad input or options; 1 a defect of this program; 130 interrupted
"""


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are input errors like all others: one line, no usage text."""

    def error(self, message: str) -> NoReturn:
        _, _, command = self.prog.partition(" ")
        raise InputError(command or "arguments", message, f"see {self.prog} --help")

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        try:
            return super()._get_value(action, arg_string)
        except argparse.ArgumentError as error:
            if action.type is float:
                error.message = not_a_number(arg_string)
            raise

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            error.message += did_you_mean(str(value), map(str, action.choices or ()))
            raise

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        # argparse would leave what a command does not know to the outermost parser, which names no command
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            hint = did_you_mean(unknown[0].partition("=")[0], self._option_string_actions)
            self.error(f"unknown argument {unknown[0]}{hint}")
        return found, unknown


class _Version(argparse.Action):
    """Print the version, which is read from the installed metadata only when asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        sys.stdout.write(f"{parser.prog} {fb.__version__}\n")
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of all commands; each parsed command carries its function as ``run``."""
    parser = _Parser(
        prog="friction-bayes",
        description="Dry friction from a free decay: closed-form Bayesian estimates, checked by MCMC.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, parser_class=_Parser)
    for command in COMMANDS:
        command.add_parser(commands)
    return parser


def _complain(message: str) -> None:
    line = " ".join(message.split())
    sys.stderr.write(f"friction-bayes: {line}\n")


def _stands_for_interrupt(error: BaseException | None) -> bool:
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program name; those of the process when left out.

    Returns
    -------
    int
        Exit status: 0 done, 2 bad input or options, 1 a defect, 130 interrupted.
    """
    if _COMPLETING in os.environ:
        from argcomplete import autocomplete

        # answers the shell and ends the process
        autocomplete(build_parser())
    try:
        given = one_value_each(sys.argv[1:] if argv is None else argv, "--prior")
        arguments = build_parser().parse_args(given)
        arguments.handler(arguments)
    except InputError as error:
        _complain(error.for_command_line)
        return 2
    except KeyboardInterrupt as error:
        _complain(f"interrupted; {str(error) or 'nothing was written'}")
        return 130
    except BrokenPipeError:
        # The reader of our output has gone (head, less): no reason to complain, and Python must not
        # try to flush into the closed pipe once more at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        # C code that Ctrl-C meets in a callback raises an error of its own in its place
        if _stands_for_interrupt(error):
            _complain("interrupted; nothing was written")
            return 130
        if os.environ.get(_DEBUG):
            raise
        _complain(
            f"a defect in this program ({type(error).__name__}: {error}); "
            f"run again with {_DEBUG}=1 for the traceback and report it"
        )
        return 1
    return 0


def command() -> int:
    """Run :func:`main` as the whole of a process.

    A library may leave a damaged file half open. What that raises when Python throws it away, after this
    program has said what is wrong with the file, is not shown.
    """
    # the threads of SciPy's BLAS spin from when it is loaded, a tenth of the time of an estimate
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    gc.set_threshold(_COLLECTED_AFTER)
    if not os.environ.get(_DEBUG):
        sys.unraisablehook = lambda _: None
    status = main()
    # what is left dies with the process: Python would first look through all of it, a tenth of the time
    gc.freeze()
    return status
