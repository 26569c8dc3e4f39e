"""What the programs share that draw results for the docs: their options, and the results themselves."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from experiments.sources import stored_result, why_not_usable

__all__ = ["figure_parser", "load_results"]


def figure_parser(module: str, description: str | None, out: str) -> argparse.ArgumentParser:
    """Return the options of every such program: where the results are and where the figures go.

    Parameters
    ----------
    module : str
        Of the program, as ``python -m`` takes it.
    description : str
        What it draws.
    out : str
        Where the figures go by default.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {module}", description=description)
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path(out), help="(default %(default)s)")
    return parser


def load_results(parser: argparse.ArgumentParser, results: Path, names: Sequence[str]) -> list[xr.Dataset]:
    """Load results, or end the program where one is not there or is of other sources than these.

    Parameters
    ----------
    parser : argparse.ArgumentParser
        Of the program.
    results : Path
        Folder with the results.
    names : sequence of str
        Of the experiments.
    """
    for name in names:
        if reason := why_not_usable(name, results):
            parser.error(reason)
    return [stored_result(name, results) for name in names]
