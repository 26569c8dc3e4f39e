"""The page of the measured data sets, as the registry has them.

Run as a program, with the folder of the package on the path, it writes the page of the documentation.
"""

from __future__ import annotations

from pathlib import Path

from friction_bayes.core.system import Oscillator
from friction_bayes.core.text import listed
from friction_bayes.records.datasets import DataSet, list_datasets

__all__ = ["PAGE", "page"]

PAGE = Path(__file__).parents[1] / "docs" / "datasets.md"

_HEAD = """# Measured data sets

Made by `python tests/data_sets.py` from the registry, `friction_bayes/records/dataset_registry.toml`. How
they are fetched is under [records and data sets](data.md#measured-data-sets). A set with a licence may be
passed on under it. One that states none leaves every right with its author: its files are fetched from there
to be read, and never shipped by this package or its archive of results.
"""


def page() -> str:
    """The page, a section a data set."""
    return _HEAD + "".join(map(_section, list_datasets()))


def _section(found: DataSet) -> str:
    upstream = f"https://github.com/{found.repository}/tree/{found.commit}"
    declared = "assumed in part" if found.system_assumed else "as published"
    parts = "".join(f"- **`{part.name}`**: {part.note}\n" for part in found.parts.values() if part.note)
    return (
        f"\n## {found.name}\n\n{found.title}.\n\n"
        f"- **Source**: {found.citation}; [{found.repository}]({upstream}) @ `{found.commit[:10]}`\n"
        f"- **Licence**: {found.licence}\n"
        f"- **Signal**: {found.quantity.replace('_', ' ')}, {_parts(found)}\n"
        f"- **System**: {_system(found.system)}, {declared}: {found.system_source}\n"
        f"- **Its authors assume**: {found.authors_assume}\n"
        f"- **Beware**: {found.note}\n{parts}"
    )


def _parts(found: DataSet) -> str:
    first = f"`{found.default}`"
    others = [f"`{name}`" for name in found.parts if name != found.default]
    return f"part {first} by default; also {listed(others, 'and')}" if others else f"part {first}"


def _system(system: Oscillator) -> str:
    kind = "pendulum" if system.pendulum else "rotor" if system.angular else "mass on a spring"
    unit = "kg m2" if system.angular else "kg"
    torque = "N m" if system.pendulum else "N m/rad" if system.angular else "N/m"
    return (
        f"{kind}, {_with_sd(system.moving, system.moving_sd)} {unit}, "
        f"{_with_sd(system.stiffness, system.stiffness_sd)} {torque}"
    )


def _with_sd(value: float, sd: float) -> str:
    return f"{value:.4g} ± {sd:.2g}" if sd else f"{value:.4g}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
