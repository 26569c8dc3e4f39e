"""What an estimate says, line by line: one text for the table of the terminal and for the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from friction_bayes.core.text import duration, number, of_friction, with_interval

__all__ = ["JUDGEMENTS", "apart", "estimate_story"]

JUDGEMENTS = {
    True: "agrees with the closed form",
    False: "DOES NOT AGREE with the closed form",
    None: "NOT JUDGED against the closed form",
}
"""Whether a sampler agrees, in words."""


def estimate_story(result: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and text of each line; texts may have several lines.

    Parameters
    ----------
    result : mapping
        The estimate as :meth:`Estimate.to_dict` gives it, its ``reference`` included where one was sampled.
    """
    rows = [
        ("friction", with_interval(result["friction"])),
        ("friction / stiffness", with_interval(result["friction_over_stiffness"])),
        ("P(friction < 0)", number(result["probability_negative"], 2)),
    ]
    if result["precision"] is not None:
        rows.append(("precision", with_interval(result["precision"], 4)))
    if result["acceptance"] is not None:
        word = "yes" if result["accepted"] else "NO"
        rows.append(("accepted", f"{word}: {result['acceptance']['because']}"))
    rows.append(("frequency", _frequency(result)))
    noise, rest = result["noise_sd"], result["rest_position"]
    if noise["mean"] is not None:
        rows.append(("noise per sample", f"sd {number(noise['mean'])} {noise['unit']}"))
    if result["random_force"] is not None:
        rows.append(("random force", _random_force(result["random_force"], result["friction"])))
    rows.append(("rest position", f"{number(rest['mean'])} {rest['unit']}"))
    rows.append(("amplitudes", str(result["amplitudes"])))
    if result["reference"] is not None:
        rows.append(("emcee", _reference(result["reference"])))
    return rows + [("note", text) for text in result["notes"]]


def _frequency(result: Mapping[str, Any]) -> str:
    frequency = result["frequency"]
    spread = "" if frequency["sd"] is None else f" ± {number(frequency['sd'], 2)}"
    return f"{number(frequency['mean'], 6)}{spread} rad/s, declared {number(frequency['declared'], 6)} rad/s"


def _random_force(force: Mapping[str, Any], friction: Mapping[str, Any]) -> str:
    return (
        f"probability {number(force['probability'], 2)}; if there, sd {with_interval(force['sd'], 2)}"
        f"{of_friction(force['share_of_friction'], friction['interval90'])}, "
        f"over {number(force['correlation_time']['mean'], 2)} s"
    )


def _reference(reference: Mapping[str, Any]) -> str:
    trust = "" if reference["converged"] else "NOT CONVERGED: "
    lines = [
        f"{with_interval(reference['friction'])}, {reference['checked']}",
        f"{trust}R-hat {reference['rhat']:.4f}, effective sample size {reference['ess_bulk']:.0f}",
        f"{JUDGEMENTS[reference['agrees']]} (false-alarm rate {reference['false_alarm_rate']:.0%}); "
        f"means {apart(reference)} sd apart",
        f"took {duration(reference['sampler_s'])}",
    ]
    if not reference["agrees"]:
        lines.insert(3, reference["because"])
    return "\n".join(lines)


def apart(reference: Mapping[str, Any]) -> str:
    """Distance of the two means in posterior sd, which shows whether a disagreement matters."""
    difference = reference["difference_in_sd"]
    return "–" if difference is None else f"{abs(difference):.2f}"
