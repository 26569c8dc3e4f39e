"""The page of one visitor: four steps from a dropped file to the answer."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Awaitable, Callable, Mapping
from functools import wraps
from html import escape
from pathlib import Path
from typing import Any

import panel as pn
import xarray as xr
from bokeh.events import Tap
from bokeh.models import Span
from bokeh.plotting import figure

from friction_bayes.app.request import ANSWERS, SYSTEMS, Request
from friction_bayes.app.running import Answer, Run
from friction_bayes.app.understood import READING, Understood, curve, in_words_of_the_page, understand
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.core.text import words
from friction_bayes.records.readers import READERS
from friction_bayes.records.record import DUPLICATES

__all__ = ["MOST_MEGABYTES", "STYLE", "Page"]

MOST_MEGABYTES = 200
"""Largest file that the page takes."""
_FOUND = "as found"
_LOOK_EVERY_S = 0.2
_SYSTEM_OF_ANGLES = "mass on a string or rod"
_LINE, _LIMIT = "#0b4f8a", "#a33e00"

STYLE = """
:root { --bokeh-font-size: 15px; --bokeh-base-font: system-ui, "Segoe UI", Helvetica, Arial, sans-serif; }
body { background: #eef1f4; color: #1b1f24; }
"""
_PARTS = """
h1 { font-size: 24px; margin: 10px 0 0; } h2 { font-size: 19px; margin: 14px 0 2px; } p { margin: 4px 0; }
.quiet { color: #545d68; }
.problem { border-left: 4px solid #a33e00; background: #fbf1ea; padding: 8px 14px; }
.answer { border-left: 4px solid #0b4f8a; background: #f0f4f8; padding: 8px 14px; font-size: 19px; }
table { border-collapse: collapse; } th, td { text-align: left; padding: 2px 18px 2px 0; }
th { font-weight: 600; border-bottom: 1px solid #d9dee4; }
pre { background: #f0f4f8; padding: 10px 14px; overflow-x: auto; margin: 4px 0; font-size: 14px; }
iframe { width: 100%; height: 920px; border: 1px solid #d9dee4; }
"""


def _html(content: str) -> pn.pane.HTML:
    return pn.pane.HTML(content, sizing_mode="stretch_width", stylesheets=[_PARTS])


def _problem(text: str) -> str:
    return f'<p class="problem" role="alert">{escape(text)}</p>' if text else ""


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


def _number(name: str, unit: str) -> pn.widgets.FloatInput:
    spoken = f"{words(name)} [{unit}]" if unit else words(name)
    return pn.widgets.FloatInput(label=spoken, value=None, width=170)


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
        self._drop = pn.widgets.FileDropper(
            multiple=False, max_file_size=f"{MOST_MEGABYTES}MB", sizing_mode="stretch_width", previews=[]
        )
        quantities = {words(name): name for name in QUANTITIES}
        choices: dict[str, Mapping[str, str]] = {
            "time_column": {},
            "signal_column": {},
            "quantity": quantities,
            "duplicates": {name: name for name in DUPLICATES},
        }
        units = {"sampling_rate": "Hz", "start": "s", "end": "s"}
        self._reading: dict[str, Any] = {}
        for name in READING:
            if name in choices:
                self._reading[name] = pn.widgets.Select(
                    label=words(name), options={_FOUND: "", **choices[name]}, width=170
                )
            elif name == "unit":
                self._reading[name] = pn.widgets.TextInput(label=name, placeholder=_FOUND, width=170)
            elif name in ("run", "skip_rows"):
                self._reading[name] = pn.widgets.IntInput(label=words(name), value=None, start=0, width=170)
            else:
                self._reading[name] = _number(name, units.get(name, ""))
        self._unsaid = {name: field.value for name, field in self._reading.items()}
        self._kind = pn.widgets.Select(label="what swings", options=[*SYSTEMS], width=220)
        self._values = {
            kind: {name: _number(name, unit) for name, unit in {**told.fields, **told.optional}.items()}
            for kind, told in SYSTEMS.items()
        }
        self._command = pn.widgets.RadioBoxGroup(
            label="answer", options={text: command for command, text in ANSWERS.items()}
        )
        self._button = pn.widgets.Button(label="Find friction", color="primary", disabled=True)
        self._stop = pn.widgets.Button(label="Stop", visible=False)
        self._bar = pn.indicators.Progress(active=True, value=-1, width=220, visible=False)
        self._said = _html("")
        self._read, self._columns, self._problem = _html(""), _html(""), _html("")
        self._plot = pn.Column(sizing_mode="stretch_width")
        self._system = pn.FlexBox()
        self._answer = pn.Column(sizing_mode="stretch_width")

    def _laid_out(self) -> pn.Column:
        first = ("time_column", "signal_column", "quantity", "unit", "sampling_rate")
        rest = ("scale", "run", "skip_rows", "duplicates")
        formats = ", ".join(suffix for suffix in READERS if suffix != ".zarr")
        self._mending = pn.Column(
            _html("<p>Where that is wrong, correct it:</p>"),
            pn.FlexBox(*(self._reading[name] for name in first)),
            pn.Card(
                pn.FlexBox(*(self._reading[name] for name in rest)),
                title="rarely needed",
                collapsed=True,
                margin=(10, 5),
            ),
            self._plot,
            pn.FlexBox(self._reading["start"], self._reading["end"]),
            sizing_mode="stretch_width",
            visible=False,
        )
        return pn.Column(
            _html(
                "<h1>Friction from a free decay</h1><p class=quiet>Everything stays on this computer.</p>"
                f"<h2>1 Drop a recording</h2><p class=quiet>{formats}; {MOST_MEGABYTES} MB at most.</p>"
            ),
            self._drop,
            _html("<h2>2 What was understood of it</h2>"),
            self._read,
            self._columns,
            self._mending,
            _html("<h2>3 What swings</h2>"),
            self._kind,
            self._system,
            _html("<h2>4 The answer</h2>"),
            self._command,
            pn.Row(self._button, self._stop, self._bar, self._said),
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
        told = {name: field.value for name, field in self._reading.items()}
        return {name: value for name, value in told.items() if value not in (None, "")}

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
            _problem(found.problem) if found.record is None else f"<p><b>{escape(found.sentence)}</b></p>"
        )
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(what) or '–'}</td></tr>"
            for name, what in found.columns.items()
        )
        heading = "<tr><th scope=col>column</th><th scope=col>the file says</th></tr>"
        self._columns.object = f"<table>{heading}{rows}</table>" if rows else ""
        self._resetting = True
        for key in ("time_column", "signal_column"):
            field = self._reading[key]
            chosen = field.value if field.value in found.columns else ""
            field.options = {_FOUND: "", **{name: name for name in found.columns}}
            field.value = chosen
        self._resetting = False
        self._mending.visible = self._path is not None
        drawn = found.record if found.whole is None else found.whole
        self._plot.objects = [] if drawn is None else [self._drawn(drawn)]
        self._button.disabled = found.record is None
        if found.record is not None:
            angular = QUANTITIES[found.record.attrs["quantity"]].angular
            if angular and self._kind.value == next(iter(SYSTEMS)):
                self._kind.value = _SYSTEM_OF_ANGLES

    def _drawn(self, record: xr.DataArray) -> pn.pane.Bokeh:
        """The record with its start and end; a click sets the start."""
        time, values = curve(record)
        axes = figure(
            height=320,
            sizing_mode="stretch_width",
            tools="box_zoom,reset",
            x_axis_label="time [s]",
            y_axis_label=f"{words(record.attrs['quantity'])} [{record.attrs['units']}]",
            title="click where the motion is free: the record is taken from there on",
            background_fill_color="white",
        )
        axes.toolbar.logo = None
        axes.line(time, values, color=_LINE, line_width=1.0)
        for name in ("start", "end"):
            if (at := self._reading[name].value) is not None:
                axes.add_layout(Span(location=at, dimension="height", line_color=_LIMIT, line_width=2.0))
        axes.on_event(Tap, self._tapped)
        return pn.pane.Bokeh(axes, sizing_mode="stretch_width", height=320)

    def _tapped(self, event: Any) -> None:
        self._reading["start"].value = float(f"{event.x:.6g}")

    def _show_system(self) -> None:
        self._system.objects = [*self._values[self._kind.value].values()]

    def complain(self, text: str) -> None:
        """Show what is wrong, in the place of an answer."""
        self._working(False)
        self._problem.object = _problem(text)

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
            self.complain(str(error))
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
            _html(f'<p class="answer" role="status">{escape(answer.sentence)}</p>'),
            pn.widgets.FileDownload(
                file=str(report),
                filename=f"{Path(request.file).stem}_report.html",
                label="Download the report",
                color="primary",
            ),
            # a page that loads nothing, in a frame that may run nothing
            _html(f'<iframe title="The report" sandbox srcdoc="{escape(answer.page)}"></iframe>'),
            _html(again),
        ]
