"""The page of one visitor: four steps from a dropped file to the answer."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Awaitable, Callable
from functools import wraps
from html import escape
from pathlib import Path
from typing import Any

import panel as pn

from friction_bayes.app import fields
from friction_bayes.app.request import ANSWERS, SYSTEMS, Request
from friction_bayes.app.running import Answer, Run
from friction_bayes.app.understood import Understood, in_words_of_the_page, understand
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.records.readers import READERS

__all__ = ["MOST_MEGABYTES", "Page"]

MOST_MEGABYTES = 200
"""Largest file that the page takes."""
_LOOK_EVERY_S = 0.2
_CLICK = "<p>Click where the motion is free: the record is taken from there on.</p>"
_FIRST = ("time_column", "signal_column", "quantity", "unit", "sampling_rate")
_RARE = ("scale", "run", "skip_rows", "duplicates")
_SYSTEM_OF_ANGLES = "mass on a string or rod"


def _never_silent(step: Callable[[Page, Any], Awaitable[None]]) -> Callable[[Page, Any], Awaitable[None]]:
    """Show on the page what a step did not foresee, which would else be seen by the terminal alone."""

    @wraps(step)
    async def guarded(page: Page, event: Any) -> None:
        try:
            await step(page, event)
        except Exception as error:
            page.complain(f"a defect in this program ({type(error).__name__}: {error}); please report it")
            raise

    return guarded


class Page:
    """What one visitor sees, and has dropped.

    Parameters
    ----------
    folder : pathlib.Path
        An empty folder of this visitor's own.

    Attributes
    ----------
    view : panel.Column
        The page.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._path: Path | None = None
        self._run: Run | None = None
        self._readings = 0
        self._resetting = False
        self._make_fields()
        self._drop.param.watch(self._dropped, "value")
        for field in self._reading.values():
            field.param.watch(self._changed, "value")
        self._kind.param.watch(lambda _: self._show_system(), "value")
        self._button.on_click(self._pressed)
        self._stop.on_click(lambda _: self._end_run())
        self._show_system()
        self.view = self._laid_out()

    def close(self) -> None:
        """End what is running and remove what was dropped."""
        self._end_run()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _end_run(self) -> None:
        if self._run is not None:
            self._run.stop()

    def _make_fields(self) -> None:
        self._drop = fields.drop(MOST_MEGABYTES)
        self._reading = fields.reading()
        self._unsaid = {name: field.value for name, field in self._reading.items()}
        self._kind = pn.widgets.Select(label="what swings", options=[*SYSTEMS], width=220)
        self._values = fields.systems()
        self._command = pn.widgets.RadioBoxGroup(
            label="answer", options={text: command for command, text in ANSWERS.items()}
        )
        self._button = pn.widgets.Button(label="Find friction", color="primary", disabled=True)
        self._stop = pn.widgets.Button(label="Stop", visible=False)
        self._bar = pn.indicators.Progress(active=True, value=-1, width=220, visible=False)
        self._read, self._columns, self._said, self._problem = (fields.html("") for _ in range(4))
        self._plot = pn.Column(sizing_mode="stretch_width")
        self._system = pn.FlexBox()
        self._answer = pn.Column(sizing_mode="stretch_width")
        self._mending = pn.Column(
            fields.html("<p>Where that is wrong, correct it:</p>"),
            pn.FlexBox(*(self._reading[name] for name in _FIRST)),
            pn.Card(
                pn.FlexBox(*(self._reading[name] for name in _RARE)),
                title="▸ more: scale, run, rows to skip, duplicates",
                collapsed=True,
                margin=(10, 5),
            ),
            self._plot,
            pn.FlexBox(self._reading["start"], self._reading["end"]),
            sizing_mode="stretch_width",
            visible=False,
        )

    def _laid_out(self) -> pn.Column:
        formats = ", ".join(suffix for suffix in READERS if suffix != ".zarr")
        return pn.Column(
            fields.html(
                "<h1>Friction from a free decay</h1><p class=quiet>Everything stays on this computer.</p>"
                f"<h2>1 Drop a recording</h2><p class=quiet>{formats}; {MOST_MEGABYTES} MB at most.</p>"
            ),
            self._drop,
            fields.html("<h2>2 What was understood of it</h2>"),
            self._read,
            self._columns,
            self._mending,
            fields.html("<h2>3 What swings</h2>"),
            self._kind,
            self._system,
            fields.html("<h2>4 The answer</h2>"),
            self._command,
            pn.FlexBox(self._button, self._stop, self._bar, align_items="center"),
            self._said,
            self._problem,
            self._answer,
            max_width=1080,
            styles={"margin": "0 auto", "padding": "8px 24px 48px", "background": "white"},
            sizing_mode="stretch_width",
        )

    @_never_silent
    async def _dropped(self, event: Any) -> None:
        """Keep the file under its own name and say what is understood of it."""
        files = event.new
        self._end_run()
        if self._path is not None:
            self._path.unlink(missing_ok=True)
            self._path = None
        self._forget_answer()
        if not files:
            self._show(Understood(problem="drop a file"))
            return
        name, content = list(files.items())[-1]
        path = self._folder / Path(name.replace("\\", "/")).name
        # text comes decoded
        data = content.encode() if isinstance(content, str) else content
        if len(data) > MOST_MEGABYTES * 1_000_000:
            self._show(Understood(problem=f"{name}: larger than {MOST_MEGABYTES} MB; use the command line"))
            return
        path.write_bytes(data)
        self._path = path
        self._resetting = True
        for name, field in self._reading.items():
            field.value = self._unsaid[name]
        self._resetting = False
        await self._understand()

    @_never_silent
    async def _changed(self, _: Any) -> None:
        if not self._resetting and self._path is not None:
            self._forget_answer()
            await self._understand()

    @property
    def _told(self) -> dict[str, Any]:
        """What was said of how the file is read."""
        entered = {name: field.value for name, field in self._reading.items()}
        return {name: value for name, value in entered.items() if value not in (None, "")}

    async def _understand(self) -> None:
        """Read the file aside, and show what came of the latest reading alone."""
        self._readings += 1
        mine, path = self._readings, self._path
        assert path is not None
        self._read.object = '<p class="quiet" role="status">reading</p>'
        found = await asyncio.to_thread(understand, path, self._told)
        if mine == self._readings:
            self._show(found)

    def _show(self, found: Understood) -> None:
        self._read.object = (
            fields.problem(found.problem)
            if found.record is None
            else f"<p><b>{escape(found.sentence)}</b></p>"
        )
        self._columns.object = fields.columns_table(found.columns)
        self._resetting = True
        for key in ("time_column", "signal_column"):
            field = self._reading[key]
            chosen = field.value if field.value in found.columns else ""
            field.options = fields.choices_of(found.columns)
            field.value = chosen
        self._resetting = False
        self._mending.visible = self._path is not None
        drawn = found.record if found.whole is None else found.whole
        marks = [at for name in ("start", "end") if (at := self._reading[name].value) is not None]
        self._plot.objects = (
            [] if drawn is None else [fields.html(_CLICK), fields.plot(drawn, marks, self._take_from)]
        )
        self._button.disabled = found.record is None
        if found.record is not None:
            angular = QUANTITIES[found.record.attrs["quantity"]].angular
            if angular and self._kind.value == next(iter(SYSTEMS)):
                self._kind.value = _SYSTEM_OF_ANGLES

    def _take_from(self, time: float) -> None:
        self._reading["start"].value = float(f"{time:.6g}")

    def _show_system(self) -> None:
        self._system.objects = [*self._values[self._kind.value].values()]

    def complain(self, text: str) -> None:
        """Show what is wrong, in the place of an answer."""
        self._working(False)
        self._problem.object = fields.problem(text)

    def _forget_answer(self) -> None:
        self._answer.objects = []
        self._problem.object = ""

    @_never_silent
    async def _pressed(self, _: Any) -> None:
        """Run the command, show how far it is, and then what it has found."""
        self._forget_answer()
        path = self._path
        if path is None:
            return
        request = Request(
            file=path.name,
            reading=self._told,
            system=self._kind.value,
            values={name: field.value for name, field in self._values[self._kind.value].items()},
            command=self._command.value,
        )
        try:
            arguments = request.arguments()
        except InputError as error:
            self.complain(error.for_command_line)
            return
        shutil.rmtree(self._folder / request.folder, ignore_errors=True)
        self._run = Run(arguments, self._folder)
        self._working(True)
        while self._run.going_on:
            self._said.object = f'<p class="quiet" role="status">{escape(self._run.progress)}</p>'
            await asyncio.sleep(_LOOK_EVERY_S)
        if problem := self._run.problem():
            self.complain(in_words_of_the_page(problem, path))
        else:
            self._working(False)
            self._show_answer(request, Answer(request.command, self._folder / request.folder))

    def _working(self, works: bool) -> None:
        self._button.disabled = works
        self._stop.visible = self._bar.visible = works
        self._said.object = ""

    def _show_answer(self, request: Request, answer: Answer) -> None:
        report = self._folder / request.folder / "report.html"
        again = (
            f"<h2>The same again</h2><p>In a terminal, in the folder of the file:</p>"
            f"<pre tabindex=0>{escape(request.command_line())}</pre><p>In Python:</p>"
            f"<pre tabindex=0>{escape(request.python())}</pre>"
        )
        self._answer.objects = [
            fields.html(f'<p class="answer" role="status">{escape(answer.sentence)}</p>'),
            pn.widgets.FileDownload(
                file=str(report),
                filename=f"{Path(request.file).stem}_report.html",
                label="Download the report",
                color="primary",
            ),
            # a page that loads nothing, in a frame that may run nothing
            fields.html(f'<iframe title="The report" sandbox srcdoc="{escape(answer.page)}"></iframe>'),
            fields.html(again),
        ]
