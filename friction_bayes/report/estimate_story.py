"""What an estimate says, line by line: one text for the table of the terminal and for the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from friction_bayes.core.text import duration, interval90, number, of_friction, percent, with_interval, words
from friction_bayes.estimators.noise.noise_accounts import UNLISTED
from friction_bayes.estimators.noise.other_forces import BENT
from friction_bayes.estimators.result import Estimate

__all__ = ["JUDGEMENTS", "apart", "behind_filter", "estimate_story", "story_of_estimate"]

_LIKELY, _WORTH_A_WORD = 0.5, 0.01
"""Probabilities from which on something is there, and cannot be excluded."""
_MUCH_WIDER = 3.0
"""Times the interval of the amplitudes alone, from which on it is said what made the answer's wide."""

JUDGEMENTS = {
    True: "agrees with the closed form",
    False: "DOES NOT AGREE with the closed form",
    None: "NOT JUDGED against the closed form",
}
"""Whether a sampler agrees, in words."""


def story_of_estimate(estimate: Estimate) -> list[tuple[str, str]]:
    """The lines of :func:`estimate_story` of an estimate."""
    return estimate_story(estimate.to_dict())


def estimate_story(result: Mapping[str, Any], notes: int | None = None) -> list[tuple[str, str]]:
    """Label and text of each line; texts may have several lines.

    Parameters
    ----------
    result : mapping
        The estimate as :meth:`Estimate.to_dict` gives it, its ``reference`` included where one was sampled.
    notes : int, optional
        How many notes to give at most; all where left out.
    """
    rows = [("friction", with_interval(result["friction"]))]
    if result["random_force"] is not None:
        rows.append(("it rests on", _rests_on(result)))
    elif result["witness"] is not None:
        assumed = "white noise of the sensor: too few samples, or too little noise, to look for anything else"
        rows.append(("it rests on", assumed))
    if result["witness"] is not None:
        rows.append(("loss of amplitude", _witness(result)))
    rows += [
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
    rows.append(("rest position", f"{number(rest['mean'])} {rest['unit']}"))
    rows.append(("amplitudes", str(result["amplitudes"])))
    if result["reference"] is not None:
        rows.append(("emcee", _reference(result["reference"])))
    listed_notes = result["notes"] if notes is None else result["notes"][:notes]
    rows += [("note", text) for text in listed_notes]
    left = len(result["notes"]) - len(listed_notes)
    return rows + ([("note", f"{left} more by --verbose, and on the page that --out makes")] if left else [])


def _rests_on(result: Mapping[str, Any]) -> str:
    """What the interval is that of: noise of the sensor, other losses, a force, whether the corners count."""
    noise, force = result["noise"], result["random_force"]
    text = f"{noise['model']} noise of the sensor"
    text += behind_filter(noise["filter"])
    uneven = result["uneven_loss"]
    if uneven is not None and uneven["losses"] is not None and uneven["probability"] > _LIKELY:
        text += "".join(f", {words(name)}" for name, share in uneven["losses"].items() if share > _LIKELY)
    for name in BENT:
        if result[name] is not None and result[name]["probability"] > _LIKELY:
            text += f", {words(name)}"
    if force["probability"] > _LIKELY:
        text += f" and a force that fluctuates: {_random_force(result)}"
    elif force["probability"] > _WORTH_A_WORD:
        text += f"; a force that fluctuates cannot be excluded: {_random_force(result)}"
    if noise["filter"] is None and noise["model"] == "coloured":
        text += "; a filter that colours noise may also have made amplitudes and friction too small"
    if noise["probability_of_free_corners"] > _LIKELY:
        text += (
            f"; the turning points (probability {percent(noise['probability_of_free_corners'])}) do not have "
            "the shape that dry friction gives them, as behind a filter or under other forces, and say "
            "nothing of friction"
        )
    return text


def _witness(result: Mapping[str, Any]) -> str:
    """What the amplitudes alone say, and what that means for the answer."""
    witness = result["witness"]
    text = f"{with_interval(witness['friction'])} by the amplitudes alone"
    if not witness["agrees"]:
        return f"{text}: DOES NOT AGREE with a fit of dry friction alone, and the interval above spans both"
    wide, narrow = (
        high - low for low, high in (result["friction"]["interval90"], witness["friction"]["interval90"])
    )
    force = result["random_force"]
    if wide > _MUCH_WIDER * narrow and force is not None and force["probability"] > _LIKELY:
        return (
            f"{text}: agrees; the interval above is wider, as the force that fluctuates moves amplitudes too"
        )
    return f"{text}: agrees"


def _frequency(result: Mapping[str, Any]) -> str:
    frequency = result["frequency"]
    spread = "" if frequency["sd"] is None else f" ± {number(frequency['sd'], 2)}"
    return f"{number(frequency['mean'], 6)}{spread} rad/s, declared {number(frequency['declared'], 6)} rad/s"


def _random_force(result: Mapping[str, Any]) -> str:
    force, friction = result["random_force"], result["friction"]
    sd = force["sd"]
    return (
        f"probability {percent(force['probability'])}, sd {number(sd['mean'], 2)} {sd['unit']} "
        f"(90 %: {interval90(sd, 2)})"
        f"{of_friction(force['share_of_friction'], friction['interval90'])}, "
        f"over {number(force['correlation_time']['mean'], 2)} s"
    )


def _reference(reference: Mapping[str, Any]) -> str:
    trust = "" if reference["converged"] else "NOT CONVERGED: "
    lines = [
        f"{with_interval(reference['friction'])} by the fit alone, {reference['checked']}",
        f"{trust}R-hat {reference['rhat']:.4f}, effective sample size {reference['ess_bulk']:.0f}",
        f"{JUDGEMENTS[reference['agrees']]} (false-alarm rate {percent(reference['false_alarm_rate'])}); "
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


def behind_filter(filter_: Mapping[str, Any] | None) -> str:
    """Say which filter the record went through, as the end of a sentence; empty where there is none."""
    if filter_ is None:
        return ""
    lost = f"{100.0 * (1.0 - filter_['gain']):.2f}"
    if filter_["name"] == UNLISTED:
        return f" ({UNLISTED} may have coloured it: some {lost} % of the motion is put back)"
    put_back = "" if lost == "0.00" else f": the {lost} % that it takes of the motion is put back"
    # a loop reports a filter that it took as certain
    probability = filter_.get("probability", 1.0)
    if probability < 1.0 - _WORTH_A_WORD:
        return (
            f", behind a filter with probability {percent(probability)}, such as {filter_['name']}{put_back}"
        )
    return f", behind {filter_['name']}{put_back}"
