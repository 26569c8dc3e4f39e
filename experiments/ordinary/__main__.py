"""``python -m experiments.ordinary [ROW ...]``: the table of chosen rows, while an estimator changes."""

from __future__ import annotations

import argparse

from experiments.ordinary.recipes import RECIPES
from experiments.ordinary_records import score


def main() -> None:
    """Print the lines of each row as soon as they are there."""
    parser = argparse.ArgumentParser(prog="python -m experiments.ordinary", description=__doc__)
    parser.add_argument(
        "rows", nargs="*", metavar="ROW", help=f"beginnings of: {', '.join(RECIPES)}".replace("%", "%%")
    )
    parser.add_argument("--records", type=int, default=9, help="of each row (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="another draws other records")
    parser.add_argument("--by-sensor", action="store_true", help="lines of its own for each sensor")
    options = parser.parse_args()
    score(options.rows or None, options.records, seed=options.seed, by_sensor=options.by_sensor)


if __name__ == "__main__":
    main()
