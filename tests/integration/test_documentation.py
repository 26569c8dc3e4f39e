"""Every code block of README, docs and docstrings: Python runs, commands parse, and what is shown is printed.

What takes long is not run again here: closing the loop and sampling are called with the arguments shown and
return a small result, and commands that do either are parsed alone.
"""

from __future__ import annotations

import doctest
import importlib
import importlib.util
import inspect
import itertools
import json
import os
import re
import shlex
import shutil
import textwrap
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from decimal import Decimal
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.cli.options import one_value_each
from friction_bayes.cli.program import build_parser, main
from friction_bayes.conjugate.targets import normal_gamma_target
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.reference import sample_target

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
LINKING = [*PAGES, ROOT / "CHANGELOG.md", *sorted((ROOT / "docs" / "notebooks").glob("*.md"))]
LINK = re.compile(r"\]\((?!https?:)(?P<path>[^)#\s]*)#?(?P<anchor>[^)\s]*)\)")
BLOCK = re.compile(r"^```(?P<language>\w*)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
SLOW = {
    "cli.md": ("--check", "close-loop", "demo", "datasets", "dataset:"),
    "tutorial.md": ("close-loop", "datasets"),
}
"""What commands of a page contain that are not run."""


class Block(NamedTuple):
    """A fenced block of a page."""

    page: Path
    line: int
    language: str
    text: str
    follows_python: bool

    @property
    def place(self) -> str:
        return f"{self.page.name}:{self.line}"


def blocks_of(page: Path) -> list[Block]:
    text, blocks, end, python = page.read_text(encoding="utf-8"), [], 0, False
    for found in BLOCK.finditer(text):
        follows = python and not text[end : found.start()].strip()
        line = text.count("\n", 0, found.start()) + 1
        blocks.append(Block(page, line, found["language"], found["text"], follows))
        end, python = found.end(), found["language"] == "python"
    return blocks


BLOCKS = [block for page in PAGES for block in blocks_of(page)]
PYTHON_PAGES = [page for page in PAGES if any(block.language for block in blocks_of(page))]


def agree(shown: str, printed: str) -> bool:
    """Whether two texts are the same but for white space and the last digit or 2 % of their numbers.

    A line of ``...`` is anything.
    """
    place, words = 0, " ".join(printed.split())
    for part in re.split(r"^\.\.\.$", shown, flags=re.MULTILINE):
        wanted = " ".join(part.split())
        # numbers first: their own pattern must not be escaped
        pattern = r"([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)".join(map(re.escape, NUMBER.split(wanted)))
        pattern += r"(?!\S)"
        found = re.search(pattern, words[place:])
        if found is None:
            return False
        pairs = zip(NUMBER.findall(wanted), found.groups(), strict=True)
        if not all(np.isclose(float(a), float(b), rtol=0.02, atol=1.01 * last_digit(a)) for a, b in pairs):
            return False
        place += found.end()
    return True


def last_digit(printed: str) -> float:
    """One in the last place of a number as printed, where that has decimals."""
    return float(f"1e{Decimal(printed).as_tuple().exponent}") if "." in printed else 1e-12


def test_what_is_compared_can_differ() -> None:
    shown = "friction  0.0700 N\n...\nnote the record"
    assert agree(shown, "friction 0.0701 N\nsd 3\nnote  the record is")
    assert not agree(shown, "friction 0.08 N\nnote the record")
    assert agree("by -0.35 sd of 8", "by -0.36 sd of 8")
    assert not agree("by -0.35 sd of 8", "by -0.37 sd of 8")
    assert not agree("by -0.35 sd of 8", "by -0.35 sd of 9")
    assert not agree(shown, "friction 0.07 Nm\nnote the record")
    assert not agree(shown, "note the record\nfriction 0.07 N")


def commands_of(text: str) -> Iterator[tuple[str, str]]:
    """Each command of a block, continued lines joined, and what is shown below it."""
    lines = re.sub(r"\\\n\s*", "", text).splitlines()
    starts = [k for k, line in enumerate(lines) if re.match(r"(\$ )?(friction-bayes|python -m|make) ", line)]
    for begin, end in itertools.pairwise([*starts, len(lines)]):
        yield lines[begin].removeprefix("$ ").partition("  # ")[0], "\n".join(lines[begin + 1 : end])


@pytest.mark.parametrize("block", [b for b in BLOCKS if not b.language], ids=lambda block: block.place)
def test_commands_exist(block: Block) -> None:
    for command, _ in commands_of(block.text):
        words = shlex.split(command, comments=True)
        if words[0] == "make":
            assert re.search(rf"^{words[1]}:", (ROOT / "Makefile").read_text(), re.MULTILINE), command
        elif words[0] == "python":
            path = ROOT / words[2].replace(".", "/")
            assert (
                words[2] == "pytest" or path.with_suffix(".py").is_file() or (path / "__main__.py").is_file()
            )
        elif re.search(r"\[|[A-Z]{4}", command):
            known = subparser(words[1])._option_string_actions
            assert {option for option in re.findall(r"--[a-z-]+", block.text)} <= set(known)
        else:
            build_parser().parse_args(one_value_each(words[1:], "--prior"))


def subparser(name: str) -> Any:
    """The parser of one command."""
    return subparsers()[name]


def subparsers() -> dict[str, Any]:
    (commands,) = (action for action in build_parser()._actions if action.choices)
    return dict(commands.choices)


def test_help_of_each_command_has_an_example_that_parses() -> None:
    for name, parser in subparsers().items():
        shown = textwrap.dedent(re.sub(r"\A.*?examples?[^\n]*:\n", "", parser.epilog, flags=re.DOTALL))
        examples = [command.partition(" | ")[0] for command, _ in commands_of(shown)]
        assert any(f"friction-bayes {name}" in example for example in examples), name
        for example in examples:
            build_parser().parse_args(one_value_each(shlex.split(example, comments=True)[1:], "--prior"))


@pytest.mark.parametrize("page", LINKING, ids=lambda page: page.name)
def test_links_within_the_documentation_lead_somewhere(page: Path) -> None:
    for found in LINK.finditer(BLOCK.sub("", page.read_text(encoding="utf-8"))):
        target = page.parent / found["path"] if found["path"] else page
        assert target.exists(), found[0]
        assert not found["anchor"] or found["anchor"] in anchors_of(target), found[0]


def anchors_of(page: Path) -> set[str]:
    """What links to the headings of a page are called."""
    headings = re.findall(r"^#+ (.*)$", BLOCK.sub("", page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) <= 700
    assert (ROOT / "docs" / "figures" / "answer.png").stat().st_size < 150e3


def test_the_pages_by_hand_are_short() -> None:
    """Of all sections but the results; data sets and kinds of files are tables that are generated."""
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r":caption: (.*?)\n:maxdepth: 1\n\n(.*?)```", index, re.DOTALL))
    generated = {"kinds_of_files", "datasets", "contributing", "changelog", "examples/index"}
    pages = {"index"}.union(*(sections[name].split() for name in ("Start", "Use", "Science", "Reference")))
    files = [ROOT / "docs" / f"{page}.md" for page in pages - generated]
    texts = [file.read_text(encoding="utf-8") for file in [*files, *(ROOT / "docs" / "gallery").iterdir()]]
    assert sum(len(text.split()) for text in texts) <= 15_000


@pytest.mark.parametrize("page", LINKING, ids=lambda page: page.name)
def test_no_bullet_is_long(page: Path) -> None:
    text = BLOCK.sub("", page.read_text(encoding="utf-8"))
    for item in re.findall(
        r"^ *(?:-|\d+\.) (.*?)(?=^ *(?:-|\d+\.) |^\s*$|\Z)", text, re.DOTALL | re.MULTILINE
    ):
        assert len(item.split()) <= 80, item


def test_the_reference_has_every_public_name() -> None:
    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    for name in ("", ".testing", ".plotting", ".mechanics.effects"):
        module = importlib.import_module(f"friction_bayes{name}")
        _, _, part = text.partition(f".. currentmodule:: {module.__name__}\n")
        listed = re.findall(r"^   (\w+)$", part.partition("currentmodule::")[0], re.MULTILINE)
        public = {name for name in module.__all__ if callable(getattr(module, name))}
        assert set(listed) == public, module.__name__


@pytest.mark.parametrize(
    "path",
    [path for path in sorted(Path(fb.__file__).parent.rglob("*.py")) if ">>> " in path.read_text()],
    ids=lambda path: path.stem,
)
def test_examples_of_docstrings(path: Path) -> None:
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    result = doctest.testmod(importlib.import_module(module))
    assert result.attempted > 0
    assert result.failed == 0


@pytest.mark.usefixtures("without_figures", "without_loop_folder")
@pytest.mark.parametrize(("page", "least"), [("cli.md", 7), ("close-loop.md", 1), ("tutorial.md", 2)])
def test_commands_print_what_is_shown(
    page: str,
    least: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    if page == "tutorial.md":
        measured = Path(os.environ.get("FRICTION_BAYES_DATA", "")) / "rotary-pendulum"
        if not measured.is_dir():
            pytest.skip("the measured records are not here: set FRICTION_BAYES_DATA")
        shutil.copy(measured / "pendulum_free_swing_data_02.txt", "swing.txt")
    compared = 0
    for block in blocks_of(ROOT / "docs" / page):
        for command, shown in commands_of(block.text):
            words = shlex.split(command, comments=True)
            if (
                words[0] != "friction-bayes"
                or "[" in command
                or any(slow in command for slow in SLOW.get(page, ()))
            ):
                continue
            main(list(itertools.chain.from_iterable(map(expanded, words[1:]))))
            out, err = capsys.readouterr()
            if shown.strip():
                assert agree(shown, out + err), f"{block.place}: {command}\n{out}{err}"
                compared += 1
    assert compared >= least


@pytest.mark.usefixtures("without_loop_figures")
def test_the_quickstart_says_what_the_reports_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = ROOT / "docs" / "quickstart.md"
    for block in blocks_of(page):
        for command, _ in commands_of(block.text):
            words = shlex.split(command)
            if words[:2] in (["friction-bayes", "simulate"], ["friction-bayes", "close-loop"]):
                assert main(words[1:]) == 0, command
    first, both = (json.loads(Path(folder, "report.json").read_text()) for folder in ("loop", "both"))
    text = page.read_text(encoding="utf-8")
    assert f"The verdict is [`{first['verdict']}`]" in text
    (suggested,) = re.findall(r"The report suggests a release from (.*):", text)
    assert f"released from {suggested}:" in first["next_experiment"]
    found, alone = both["friction_after"]["mean"], first["friction_before"]["mean"]
    assert f"friction is {found:.3g} N, known to 1 %, where dry friction alone gives {alone:.2g} N" in text
    assert max(abs(bound / found - 1.0) for bound in both["friction_after"]["interval90"]) < 0.01


def expanded(word: str) -> list[str]:
    """What a shell makes of a word."""
    return sorted(path.name for path in Path().glob(word)) if "?" in word else [word]


@pytest.fixture(scope="module")
def small_report() -> fb.LoopReport:
    """A loop closed with one effect in sight."""
    return fb.close_loop(
        [short_decay()], SYSTEM, seed=1, effects=["viscous_damping"], random_force="none", noise="white"
    )


@pytest.fixture
def readers_names(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """What each page takes its reader to have."""
    draws = rng.gamma(3.0, size=(4, 5000))
    truth = rng.normal(size=2000)
    centre = truth + rng.normal(size=2000)
    reach = stats.norm.ppf(0.95)
    values = rng.normal(size=(2, 3, 50))
    return {
        "arviz.md": {"record": short_decay(), "system": SYSTEM},
        "close-loop.md": {
            "high": short_decay(),
            "low": short_decay(initial_displacement=0.01),
            "record": short_decay(),
            "system": SYSTEM,
        },
        "figures.md": {"record": short_decay(), "system": SYSTEM},
        "monitor.md": {"xr": importlib.import_module("xarray"), "values": values, "seconds": np.arange(50.0)},
        "testing.md": {
            "my_sampler": lambda chains, draws: rng.gamma(3.0, size=(chains, draws)),
            "my_density": stats.gamma(3.0).pdf,
            "my_cdf": stats.gamma(3.0).cdf,
            "exact_draws": draws.ravel(),
            "lower": centre - reach,
            "upper": centre + reach,
            "truth": truth,
            "assert_coverage": fb.testing.assert_coverage,
            "assert_prior_recovered": fb.testing.assert_prior_recovered,
            "draws_without_data": draws,
        },
    }


def in_its_place(real: Callable[..., Any], result: Any) -> Callable[..., Any]:
    """Take the arguments of a slow function and return something small."""

    def quick(*args: Any, **settings: Any) -> Any:
        inspect.signature(real).bind(*args, **settings)
        return result

    return quick


@pytest.fixture(scope="module")
def sampled() -> xr.DataTree:
    prior = fb.NormalGamma(mu=0.1, lam=0.01, alpha=1.0, beta=0.02)
    # without a sample far out, of which cross-validation would warn
    samples = stats.norm(0.07, 0.17).ppf(np.linspace(0.02, 0.98, 40))
    return sample_target(normal_gamma_target(prior, samples), seed=1, walkers=8)


# ArviZ 0.2x announces 1.x, and is older than what matplotlib 3.11 and pandas 3.1 deprecate
@pytest.mark.filterwarnings(r"ignore:\s*ArviZ is undergoing a major refactor:FutureWarning")
@pytest.mark.filterwarnings("ignore::matplotlib.MatplotlibDeprecationWarning")
@pytest.mark.filterwarnings("ignore:The inplace keyword:DeprecationWarning")
@pytest.mark.parametrize("page", PYTHON_PAGES, ids=lambda page: page.name)
def test_python_runs_as_shown(
    page: Path,
    readers_names: dict[str, dict[str, Any]],
    small_report: fb.LoopReport,
    sampled: xr.DataTree,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if page.name == "arviz.md" and importlib.util.find_spec("arviz") is None:
        pytest.skip("the extra arviz is not installed")
    monkeypatch.chdir(tmp_path)
    fb.write_record(short_decay(), "decay.csv")
    monkeypatch.setattr(fb, "close_loop", in_its_place(fb.close_loop, small_report))
    monkeypatch.setattr(fb, "sample_reference", in_its_place(fb.sample_reference, sampled))
    built_in = set(EFFECTS)
    names, printed = dict(readers_names.get(page.name, {})), ""
    try:
        for block in blocks_of(page):
            if block.language == "python":
                with redirect_stdout(StringIO()) as out:
                    exec(compile(block.text, block.place, "exec"), names)
                    for test in [names.pop(name) for name in list(names) if name.startswith("test_")]:
                        test()
                printed = out.getvalue()
            elif block.follows_python:
                assert agree(block.text, printed), f"{block.place}: {printed}"
    finally:
        for name in set(EFFECTS) - built_in:
            del EFFECTS[name]
