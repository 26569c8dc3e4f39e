"""Projects of the video analysis Tracker (``.trk``): the marked positions of its point masses.

A project is XML: marks in pixels by frame, a coordinate system (origin, angle of the x-axis [degree], pixels
per unit of length) that holds from a frame on, and the clip's first frame and mean time between frames.
"""

from __future__ import annotations

import math
import re
from functools import partial
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_tracker"]

_MOST_BYTES = 50 << 20
"""Of a project: some hundred thousand marks."""
_PANEL, _POINT_MASS = "tracker.TrackerPanel", "tracker.PointMass"
_EXPORT = "export the table from Tracker"
_INDEX = re.compile(r"\[(\d{1,7})\]")

Node = ElementTree.Element


class _Frame(NamedTuple):
    """The coordinate system from a frame of the video on."""

    start: int
    origin: tuple[float, float]
    angle: float
    scale: tuple[float, float]


def read_tracker(path: Path) -> Table:
    """Read the positions of every point mass as columns ``NAME x`` and ``NAME y``.

    Parameters
    ----------
    path : Path
        The project.

    Raises
    ------
    InputError
        If the file is no such project, or lacks the time between frames or a scale.
    """
    panel = _panel(path)
    step = _number(_object(panel, "clipcontrol"), "delta_t", math.nan) / 1000.0
    if not step > 0.0:
        raise InputError(str(path), "without the time between frames (delta_t)", _EXPORT)
    first = _number(_object(panel, "videoclip"), "startframe", 0.0)
    frames = _coordinate_systems(path, panel)
    unit = _text(panel, "length_unit")
    columns: dict[str, Column] = {}
    for track in _objects(_property(panel, "tracks")):
        marks = _marks(track) if track.get("class", "").endswith(_POINT_MASS) else {}
        if len(marks) < 2:
            continue
        name, order = _text(track, "name") or f"mass {len(columns) // 2 + 1}", sorted(marks)
        time = step * (np.array(order, dtype=np.float64) - first)
        for axis, values in zip("xy", _positions(marks, order, frames).T, strict=True):
            columns[f"{name} {axis}"] = Column(
                partial(np.asarray, values),
                quantity="displacement",
                unit=unit,
                clock=partial(np.asarray, time),
            )
    return Table(columns)


def _panel(path: Path) -> Node:
    """The root of a project; what could unfold to more than the file holds is refused unread."""
    if path.stat().st_size > _MOST_BYTES:
        raise InputError(str(path), f"larger than {_MOST_BYTES >> 20} MB", _EXPORT)
    content = path.read_bytes()
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise InputError(str(path), "declares entities, which no project does", _EXPORT)
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise InputError(
            str(path), f"this is not an XML file ({error})", "give the suffix of its format"
        ) from None
    if not root.get("class", "").endswith(_PANEL):
        kind = root.get("class") or root.tag
        raise InputError(
            str(path), f"holds {kind!r} and no single video", "save the tab of the video, or export its table"
        )
    return root


def _coordinate_systems(path: Path, panel: Node) -> list[_Frame]:
    """Those of a project, by the frame that they hold from."""
    found = []
    for start, node in _indexed(_property(_object(panel, "coords"), "framedata")).items():
        scale = _number(node, "xscale", 0.0), _number(node, "yscale", 0.0)
        if not (scale[0] > 0.0 and scale[1] > 0.0):
            raise InputError(str(path), f"scale {scale} at frame {start}", "calibrate the video in Tracker")
        origin = _number(node, "xorigin", 0.0), _number(node, "yorigin", 0.0)
        found.append(_Frame(start, origin, math.radians(_number(node, "angle", 0.0)), scale))
    if not found:
        raise InputError(str(path), "without a coordinate system", "calibrate the video in Tracker")
    return sorted(found)


def _marks(track: Node) -> dict[int, tuple[float, float]]:
    """Marked positions [pixels], the second downward, by frame."""
    marks = {}
    for index, node in _indexed(_property(track, "framedata")).items():
        place = _number(node, "x", math.nan), _number(node, "y", math.nan)
        if all(math.isfinite(each) for each in place):
            marks[index] = place
    return marks


def _positions(marks: dict[int, tuple[float, float]], order: list[int], frames: list[_Frame]) -> Array:
    """Positions in the coordinate system of their frame, shape (n, 2)."""
    starts = [frame.start for frame in frames]
    own = np.maximum(np.searchsorted(starts, order, side="right") - 1, 0)
    found = np.empty((len(order), 2))
    for i, (index, k) in enumerate(zip(order, own, strict=True)):
        _, (x0, y0), angle, (x_scale, y_scale) = frames[k]
        right, up = marks[index][0] - x0, y0 - marks[index][1]
        cosine, sine = math.cos(angle), math.sin(angle)
        found[i] = (cosine * right + sine * up) / x_scale, (cosine * up - sine * right) / y_scale
    return found


def _property(node: Node | None, name: str) -> Node | None:
    """The property of an object; None where it has none."""
    return (
        None if node is None else next((p for p in node.findall("property") if p.get("name") == name), None)
    )


def _object(node: Node | None, name: str) -> Node | None:
    """The object that is a property of another; None where there is none."""
    found = _property(node, name)
    return None if found is None else found.find("object")


def _objects(node: Node | None) -> list[Node]:
    """The objects of a collection."""
    return (
        [] if node is None else [each for item in node.findall("property") for each in item.findall("object")]
    )


def _indexed(node: Node | None) -> dict[int, Node]:
    """The objects of an array by their index."""
    found = {}
    for item in [] if node is None else node.findall("property"):
        index, content = _INDEX.fullmatch(item.get("name", "")), item.find("object")
        if index is not None and content is not None:
            found[int(index[1])] = content
    return found


def _text(node: Node | None, name: str) -> str | None:
    """A property's text; None where it has none."""
    found = _property(node, name)
    return None if found is None or found.text is None else found.text.strip() or None


def _number(node: Node | None, name: str, otherwise: float) -> float:
    """A property's number; ``otherwise`` where there is none that can be read."""
    try:
        return float(_text(node, name) or otherwise)
    except ValueError:
        return otherwise
