"""The page of an estimate: friction and how well it is known, the figures, and how to make it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from friction_bayes.core.text import interval90, number
from friction_bayes.report.estimate_story import estimate_story
from friction_bayes.report.page import FigureInWords, render_page, reproduction
from friction_bayes.report.story import known_within

__all__ = ["EstimatedRecord", "estimate_page", "friction_sentence"]

_FIGURES = {
    "fit": FigureInWords(
        "The record over time with its fit, the residual, and the last cycles",
        "The record and the fitted free decay; below, what is left of it, which is noise where the model "
        "holds. On the right the last cycles, and the residual with the normal distribution of the noise.",
    ),
    "residual": FigureInWords(
        "The residual over time, over phase, and its distribution",
        "What the fit leaves, over time and over the phase of the motion, and its distribution: noise has no "
        "phase, a missing effect has.",
    ),
    "amplitudes": FigureInWords(
        "The turning points over time within the envelope of the friction found",
        "The turning points, and the straight envelope of dry friction; that of the fit where more acts.",
    ),
    "friction": FigureInWords(
        "Posterior density of friction",
        "Posterior of friction in closed form, and the draws of the sampler where there is one.",
    ),
    "joint": FigureInWords(
        "Joint posterior density of friction and precision",
        "Joint posterior of friction and precision, with the region that holds 90 %.",
    ),
    "ranks": FigureInWords(
        "Ranks of each ensemble of the sampler among the draws of all",
        "Ranks of each ensemble of the sampler among the draws of all, by ArviZ: even where the "
        "ensembles have found the same posterior.",
    ),
    "ess": FigureInWords(
        "Effective sample size of the sampler's draws by quantile",
        "Effective sample size of the sampler's draws by quantile, by ArviZ; below the line are too few.",
    ),
}
"""Figures of a record, in the order of the page."""
_FOLDED = ("residual", "joint", "ranks", "ess")
_GROUNDS = {"it rests on": "noise", "loss of amplitude": "loss of amplitude", "frequency": "frequency"}
"""Lines of the story that say what the number rests on, and what they are called under that heading."""
_NEXT = (
    "A narrow interval is no proof of the model: friction-bayes close-loop shows what else acts, and how "
    "friction changes with it."
)


@dataclass(frozen=True, kw_only=True)
class EstimatedRecord:
    """What the page says of a record.

    Attributes
    ----------
    result : mapping
        As :meth:`Estimate.to_dict` gives it.
    read : str
        What was understood of the file.
    warnings : sequence of str
        What is to be read before the number.
    figures : mapping of str to bytes
        SVG of each of :func:`friction_bayes.plotting.estimate.estimate_figures`, and of
        :func:`friction_bayes.plotting.draws.draws_figures`.
    """

    result: Mapping[str, Any]
    read: str
    figures: Mapping[str, bytes]
    warnings: Sequence[str] = ()

    @property
    def sentence(self) -> str:
        """Friction and how well it is known."""
        return friction_sentence(self.result)

    @property
    def tiles(self) -> list[tuple[str, str, str]]:
        """Label, value and remark of the numbers that matter most."""
        friction, over_stiffness = self.result["friction"], self.result["friction_over_stiffness"]
        frequency, noise = self.result["frequency"], self.result["noise_sd"]
        tiles = [
            ("friction", f"{number(friction['mean'])} {friction['unit']}", f"90 %: {interval90(friction)}"),
            (
                "friction / stiffness",
                f"{number(over_stiffness['mean'])} {over_stiffness['unit']}",
                f"90 %: {interval90(over_stiffness)}",
            ),
            (
                "frequency",
                f"{number(frequency['mean'], 5)} {frequency['unit']}",
                f"declared {number(frequency['declared'], 5)} {frequency['unit']}",
            ),
        ]
        if noise["mean"] is not None:
            tiles.append(("noise per sample", f"{number(noise['mean'], 3)} {noise['unit']}", "sd"))
        return tiles

    @property
    def grounds(self) -> list[tuple[str, str]]:
        """What the number rests on."""
        return [
            ("read", self.read),
            *((_GROUNDS[name], text) for name, text in self.story if name in _GROUNDS),
        ]

    @property
    def story(self) -> list[tuple[str, str]]:
        """Everything, line by line."""
        return estimate_story(self.result)


def friction_sentence(result: Mapping[str, Any]) -> str:
    """Say friction and how well it is known, of an estimate as :meth:`Estimate.to_dict` gives it."""
    friction = result["friction"]
    return f"Friction is {number(friction['mean'])} {friction['unit']}. {known_within(friction)}"


def estimate_page(entries: Sequence[EstimatedRecord], manifest: Mapping[str, Any]) -> str:
    """Return the page of one estimate, or of those of several records.

    Parameters
    ----------
    entries : sequence of EstimatedRecord
    manifest : mapping
        Seed, options, inputs and versions, from :func:`friction_bayes.core.files.manifest`.

    Returns
    -------
    str
        HTML that holds its figures and loads nothing.
    """
    return render_page(
        "estimate.html",
        entries=entries,
        names=[entry.result["record"] for entry in entries],
        figures=_FIGURES,
        folded_figures=_FOLDED,
        next=_NEXT,
        made=reproduction(manifest),
    )
