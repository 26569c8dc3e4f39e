"""What closing the loop found, line by line: one text for the table of the terminal and for the page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from friction_bayes.core.text import (
    duration,
    fitted_part,
    listed,
    number,
    of_friction,
    of_one_sign,
    percent,
    set_words,
    with_interval,
    words,
)
from friction_bayes.loop import settings
from friction_bayes.loop.report.result import LoopReport
from friction_bayes.loop.report.verdict import AMBIGUOUS, UNEXPLAINED, credible_candidates
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.report.estimate_story import behind_filter
from friction_bayes.report.residual_tests import failures

__all__ = [
    "between_records",
    "effect_lines",
    "friction_agreed",
    "known_within",
    "loop_grounds",
    "loop_story",
    "next_step",
    "paper_words",
    "sampler_lines",
    "shown_lines",
    "shown_parameters",
    "story_of_loop",
    "summary_of",
    "the_records",
    "verdict_sentence",
]

_FAULTS = {
    "coarse_sampling": "few samples per period",
    "noise_lifts_maxima": "noise that raises the highest samples",
    "no_scatter": "friction samples that do not scatter (its interval measures no error)",
}
_TOO_WIDE = "telescoping_drops"
"""What makes the interval of the paper's procedure too wide, and nothing else wrong."""
_MOST_NAMED = 3
_NOTABLE_ROUNDING = 0.1
"""Rounding over sensor noise below which a step is that of printed digits, or says nothing of the noise."""
_MOST_SPREAD = 0.3
"""Sd of a damping ratio over its mean up to which its inverse is near normal too."""
_UNSEEN = 0.1
"""Probability that dry friction matters below which it is not seen."""
_CERTAIN = 0.95
"""The same from which on its upper limit is not reported."""

_LEAST_SHARE = 0.1
"""Of what depends on the motion, below which a shape does not describe it."""

Report = Mapping[str, Any]


def the_records(count: int) -> str:
    """Name what the loop was closed on in a sentence, be it one record or several."""
    return "the record" if count == 1 else "the records"


def friction_agreed(report: Report) -> str:
    """What follows the word of the verdict where only the effect is open; empty otherwise."""
    agreed = report["verdict"] == AMBIGUOUS and report["friction_agreed"]
    return " which effect, friction is agreed on" if agreed else ""


def verdict_sentence(report: Report, records: int = 1) -> str:
    """Say the verdict in one sentence, and in a second one which part of it a sampler went over.

    Parameters
    ----------
    report : mapping
        Fields of ``report.json``.
    records : int
        Of how many records.
    """
    return _verdict(report, records) + _sampled(report["reference_check"])


def _verdict(report: Report, records: int) -> str:
    what = the_records(records)
    best = report["candidates"][0]
    name, share = set_words(best["effects"]), percent(best["probability"])
    # tests of a long record see what is too small to matter, and the verdict goes by what matters
    left = "noise" if report["residual"]["after"]["passes"] else "too little to matter"
    if report["verdict"] == "adequate":
        known = known_within(report["friction_after"])
        added = f"with {name}" if best["effects"] else "alone"
        return f"Coulomb friction {added} explains {what}: what is left is {left}. {known}"
    if report["verdict"] == "explained":
        known = known_within(report["friction_after"])
        return f"Coulomb friction with {name} explains {what} ({share}): what is left is {left}. {known}"
    if report["verdict"] == AMBIGUOUS:
        credible = credible_candidates(report["candidates"])
        known = f" {known_within(report['friction_after'])}" if friction_agreed(report) else ""
        if report["because"]:
            known = f" Its forecast is a doubt: {_doubts(report, what)}."
        if len(credible) == 1:
            added = f" with {name}" if best["effects"] else ""
            if report["because"]:
                return f"Coulomb friction{added} explains {what} ({share}), but {_doubts(report, what)}."
            matters, failed = report["dry_friction"]["probability"], report["residual"]["after"]["failed"]
            if len(failed) > 1 and max(matters, 1.0 - matters) >= _CERTAIN:
                return (
                    f"Of the laws evaluated Coulomb friction{added} explains {what} ({share}), but what it "
                    f"leaves is not noise (failed tests: {failures(failed)}): something else acts, too weak "
                    "to change friction."
                )
            return (
                f"Coulomb friction{added} explains {what} ({share}), but the probability that dry friction "
                f"matters is only {percent(matters)}."
            )
        law = set(best["effects"]) - {"random_force"}
        if all(set(c["effects"]) - {"random_force"} == law for c in credible):
            return _with_or_without_random_force(credible, records) + known
        tied = [f"{set_words(c['effects'])} ({percent(c['probability'])})" for c in credible]
        if len(tied) > _MOST_NAMED:
            tied = [*tied[:_MOST_NAMED], f"{len(tied) - _MOST_NAMED} more"]
        shared = [name for name in best["effects"] if all(name in c["effects"] for c in credible)]
        over = f"all have {set_words(shared)}, and " * bool(shared) + "friction is averaged over them"
        return f"{what.capitalize()} cannot separate {listed(tied)}; {over}.{known}"
    against = _doubts(report, what)
    # a sentence begins with it
    against = against[0].upper() + against[1:]
    return f"{against}; the closest candidate is {name}, which is not an explanation."


def _doubts(report: Report, what: str) -> str:
    """Say what speaks against the number."""
    return "; ".join(_AGAINST[reason](report, what) for reason in report["because"])


def _left_over(report: Report, what: str) -> str:
    failed = report["residual"]["after"]["failed"]
    tests = f" (failed tests: {failures(failed)})" if failed else ""
    on = report["left"]["depends_on"]
    if on:
        like = _like(report["left"])
        return f"the force that is left depends on the {on}{tests}: an effect that the catalogue lacks{like}"
    return f"what is left of {what} is neither noise nor an effect that was evaluated{tests}"


def _shift(report: Report, what: str) -> str:
    shift = f"{number(report['left']['friction_could_shift_by'], 2)} {report['friction_after']['unit']}"
    return (
        f"what is left of {what} could shift friction by {shift}, more than half of the friction that alone "
        "would explain the loss of amplitude"
    )


def _band(report: Report, what: str) -> str:
    return f"only {percent(report['held_out_error']['inside90'])} of the part held out lies in its 90 % band"


def _worse_forecast(report: Report, what: str) -> str:
    error = report["held_out_error"]
    return (
        "the part held out is forecast worse than by Coulomb friction alone: the error is "
        f"{number(error['after'] / error['before'], 3)} times as large"
    )


def _at_odds(report: Report, what: str) -> str:
    loss, shape = (report["witnesses"][name] for name in ("loss", "shape"))
    return (
        "the witnesses disagree beyond what the interval of friction spans: the loss of amplitude says "
        f"{number(loss['mean'])} {loss['unit']}, the shape within a cycle {number(shape['mean'])}"
    )


def _contradiction(report: Report, what: str) -> str:
    between = report["friction_between_records"]
    if between["probability"] < settings.SETTINGS.credible_mass:
        return "the records contradict each other in an effect that they share (see the notes)"
    ordered = sorted(between["records"], key=lambda record: record["friction"]["mean"])
    low, high = (record["friction"]["mean"] for record in (ordered[0], ordered[-1]))
    unit = ordered[0]["friction"]["unit"]
    return (
        f"the records contradict each other: friction is {number(low)} {unit} in {ordered[0]['name']} and "
        f"{number(high)} {unit} in {ordered[-1]['name']}, {number(100.0 * (high / low - 1.0), 2)} % more; "
        f"it differs between the records with a probability of {percent(between['probability'])}"
    )


_AGAINST = {
    "left_over": _left_over,
    "shift": _shift,
    "band": _band,
    "forecast": _worse_forecast,
    "witnesses": _at_odds,
    "records": _contradiction,
}
"""What forbids to use the number (:func:`friction_bayes.loop.build_report.reasons_against`), in words."""


def _sampled(check: Report | None) -> str:
    """A further sentence on which part of what is reported a sampler went over, if one did."""
    if check is None or "sampler" not in check:
        return ""
    sampler = check["sampler"]
    part, share = set_words(sampler["sampled"]["effects"]), percent(sampler["sampled"]["probability"])
    if "friction" not in sampler:
        return f" The sampler could not go over {part} ({share})."
    found = {True: "agrees", False: "DOES NOT AGREE", None: "cannot be compared"}[sampler["agrees"]]
    return (
        f" The sampler went over one part of the posterior, {part} ({share}), without slight effects or what "
        f"is left over: {with_interval(sampler['friction'])}, with which the closed form {found}."
    )


def known_within(friction: Report) -> str:
    """How far the 90 % interval reaches to both sides of the mean; from where to where, if beyond zero."""
    mean, (low, high) = friction["mean"], friction["interval90"]
    if not mean:
        return "No friction is seen."
    if not of_one_sign((low, high)):
        return f"It lies between {number(low)} and {number(high)} {friction['unit']}, with 90 % probability."
    below, above = (number(100.0 * abs(end / mean - 1.0), 2) for end in (low, high))
    return f"Friction is known within -{below} and +{above} %, with 90 % probability."


def _with_or_without_random_force(credible: Sequence[Report], records: int) -> str:
    """Of two candidates that are one law, with a random force and without."""
    (with_one,) = (c for c in credible if "random_force" in c["effects"])
    (without,) = (c for c in credible if "random_force" not in c["effects"])
    law = f" with {set_words(without['effects'])}" if without["effects"] else ""
    does, does_not = (percent(c["probability"]) for c in (with_one, without))
    return (
        f"Coulomb friction{law} explains {the_records(records)}. Whether the force fluctuates too, "
        f"{'it does' if records == 1 else 'they do'} not show "
        f"({does} that it does, {does_not} that it does not): a longer record or a further release would."
    )


def story_of_loop(report: LoopReport) -> list[tuple[str, str]]:
    """The lines of :func:`loop_story` of a report."""
    return loop_story(report.to_dict(), len(report.traces))


def loop_story(report: Report, records: int = 1) -> list[tuple[str, str]]:
    """Label and text of each line; texts may have several lines.

    Parameters
    ----------
    report : mapping
        Fields of ``report.json``.
    records : int
        Of how many records.
    """
    rows = [
        (
            "verdict",
            f"{report['verdict'].upper()}{friction_agreed(report)}: {verdict_sentence(report, records)}",
        ),
        ("friction before", with_interval(report["friction_before"])),
        ("friction after", with_interval(report["friction_after"])),
        ("dry friction", _dry_friction(report["dry_friction"], report["friction_after"]["interval90"])),
    ]
    # priors of effects that explain nothing say nothing about friction
    if report["effects"] and report["verdict"] != UNEXPLAINED:
        rows.append(("prior", _sensitivity(report["prior_sensitivity"])))
    if report["friction_range"]:
        rows.insert(3, ("friction range", _range(report["friction_range"])))
    if report["friction_between_records"]:
        rows.append(("between records", between_records(report["friction_between_records"])))
    if report["effects"]:
        label = "closest effects" if report["verdict"] == UNEXPLAINED else "effects"
        rows.append((label, "\n".join(effect_lines(report["effects"], report["verdict"]))))
    label = "closest candidates" if report["verdict"] == UNEXPLAINED else "candidates"
    rows.append((label, "\n".join(_candidate_lines(report))))
    rows.append(("held-out error", _held_out(report["held_out_error"])))
    for when in ("before", "after"):
        rows.append((f"residual {when}", _residual(report, when)))
    rows.append(("frequency", _frequency(report)))
    rows.append(("sensor noise", _noise(report["noise"], report["held_out_error"]["unit"])))
    if report["random_force"]:
        rows.append(("random force", _random_force(report)))
    if report["witnesses"]:
        rows.append(("two witnesses", _witnesses(report["witnesses"])))
    rows.append(("left over", _left(report)))
    rows.append(("paper's procedure", paper_words(report)))
    if report["next_experiment"]:
        rows.append(("next experiment", report["next_experiment"]))
    check = report["reference_check"] or {}
    if "friction" in check:
        rows.append(("reference", _reference(check, report["friction_after"]["unit"])))
    if "force" in report["residual"]:
        rows.append(("measured force", _force(report)))
    if "sampler" in check:
        rows.append(("emcee", "\n".join(sampler_lines(check["sampler"]))))
    return rows


def loop_grounds(report: Report) -> list[tuple[str, str]]:
    """Label and text of what the answer rests on, a few lines: data, noise, and what was tested.

    Parameters
    ----------
    report : mapping
        Fields of ``report.json``.
    """
    fitted, unit = report["fitted"], report["held_out_error"]["unit"]
    part = fitted_part(fitted["from_s"], fitted["to_s"], fitted["half_cycles"])
    aside = f", {fitted['set_aside']} set aside" if fitted["set_aside"] else ""
    evaluated = report["candidates"]
    rows = [
        ("record", f"{part}, {fitted['samples']} samples{aside}"),
        ("candidates", f"{len(evaluated)} sets of effects, compared on the same samples"),
        ("sensor noise", _noise(report["noise"], unit)),
        ("residual", _residual(report, "after")),
    ]
    if report["witnesses"]:
        word = "agree" if report["witnesses"]["agree"] else "disagree"
        rows.append(
            ("two witnesses", f"friction by the loss of amplitude and by the shape of a cycle {word}")
        )
    return rows


def next_step(report: Report) -> str:
    """What to do with the answer: the next experiment, or to use it where none is asked for."""
    if report["next_experiment"]:
        return str(report["next_experiment"])
    return (
        f"Use friction after, {with_interval(report['friction_after'])}: no experiment is needed to separate "
        "candidates. A further release, closed together with this one, would show whether friction "
        "differs between them."
    )


def between_records(between: Mapping[str, Any]) -> str:
    """Whether friction differs between the records, by how much, and each one's."""
    p, spread = between["probability"], between["spread"]
    lines = [f"{percent(p)} that friction differs between the records"]
    if spread:
        lines[0] += f", by {with_interval(spread)}, {number(100.0 * between['share_of_friction'], 2)} % of it"
    if p > 0.5:
        lines.append("friction after is the mean of the distribution that each record's is drawn from")
    lines += [f"{record['name']}   {with_interval(record['friction'])}" for record in between["records"]]
    return "\n".join(lines)


def _range(readings: Mapping[str, Any]) -> str:
    """Between which readings friction lies, and every one of them."""
    ordered = sorted(readings["readings"], key=lambda reading: reading["mean"])
    low, high = ordered[0], ordered[-1]
    ends = [f"{number(r['mean'])} {readings['unit']} ({r['what']})" for r in (low, high)]
    lines = [f"between {ends[0]} and {ends[1]}"]
    lines += [f"{with_interval(reading)}   {reading['what']}" for reading in ordered]
    return "\n".join(lines)


def shown_parameters(effect: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Parameters of an effect by name; with a damping ratio comes the quality factor, ``1 / (2 zeta)``.

    Terms beyond those that a series has are zero without an error, and not shown.
    """
    every = effect["parameters"].items()
    parameters = {name: value for name, value in every if value["mean"] != 0.0 or value["sd"] != 0.0}
    zeta = parameters.get("damping_ratio")
    # to first order in the sd; a ratio that is hardly known apart from zero has no Q
    if zeta is not None and zeta["mean"] and zeta["sd"] and zeta["sd"] < _MOST_SPREAD * zeta["mean"]:
        factor = 0.5 / zeta["mean"]
        parameters["Q"] = {"mean": factor, "sd": factor * zeta["sd"] / zeta["mean"], "unit": "1"}
    return parameters


def summary_of(name: str) -> str:
    """The term of an effect; nothing of one that is not registered here."""
    return EFFECTS[name].summary if name in EFFECTS else ""


def shown_lines(effect: Mapping[str, Any]) -> list[str]:
    """Each line in the spectrum that an effect is; none where its parameters say all of them."""
    lines = effect["lines"]
    return [_line(line) for line in lines] if len(lines) > len({line["record"] for line in lines}) else []


def _line(line: Mapping[str, Any]) -> str:
    """A line in the spectrum: frequency, decay time where it dies out, and amplitude."""
    frequency, decay_time, amplitude = (line[name] for name in ("frequency", "decay_time", "amplitude"))
    dies_out = "" if decay_time is None else f", dies out in {_with_sd(decay_time)}"
    return f"{_with_sd(frequency)}{dies_out}, amplitude {_with_sd(amplitude)}"


def _with_sd(summary: Mapping[str, Any]) -> str:
    unit = "" if summary["unit"] == "1" else f" {summary['unit']}"
    spread = f" ± {number(summary['sd'], 2)}" if summary["sd"] else ""
    return f"{number(summary['mean'])}{spread}{unit}"


def effect_lines(effects: Sequence[Mapping[str, Any]], verdict: str) -> list[str]:
    """A text of each effect: its probability, unless the record is unexplained, and its parameters.

    What is several lines in the spectrum has a text of each too.
    """
    lines = []
    for effect in effects:
        parameters = [f"{words(name)} {_with_sd(p)}" for name, p in shown_parameters(effect).items()]
        probable = "" if verdict == UNEXPLAINED else f"{percent(effect['probability'])}   "
        lines.append(f"{words(effect['name'])}   {probable}{', '.join(parameters)}")
        lines += [f"  line at {line}" for line in shown_lines(effect)]
    return lines


def _candidate_lines(report: Report) -> list[str]:
    kept = credible_candidates(report["candidates"])
    if report["verdict"] == UNEXPLAINED:
        # a share among candidates none of which is true is no probability of any
        return [set_words(c["effects"]) for c in kept[:5]]
    shown = kept[:5] if len(kept) > 1 else report["candidates"][:2]
    lines = [f"{percent(c['probability']):>8}   {set_words(c['effects'])}" for c in shown]
    others = report["candidates"][len(shown) :]
    if others:
        rest = sum(c["probability"] for c in others)
        lines.append(f"{percent(rest):>8}   {len(others)} others together")
    return lines


def _held_out(error: Mapping[str, Any]) -> str:
    unit, before, after = error["unit"], error["before"], error["after"]
    text = f"{number(before, 3)} {unit} before, {number(after, 3)} {unit} after"
    if before and after is not None:
        text += f", ratio {number(after / before, 2)}{_give_or_take(error)}"
    else:
        model = "Coulomb friction alone" if before is None else "the law that was found"
        text += f" ({model} cannot be fitted to the first 70 % of the record by itself)"
    text += f"; noise floor {number(error['noise_floor'], 3)} {unit}"
    inside = error.get("inside90")
    if inside is None:
        return text
    share = "all samples" if inside == 1.0 else f"{percent(inside)} of the samples"
    return f"{text}; {share} in the 90 % band"


def _give_or_take(error: Mapping[str, Any]) -> str:
    """Monte Carlo error of a ratio of errors, where its two digits show it."""
    mcse = error.get("after_mcse") or 0.0
    shown = mcse > 0.005 * error["after"]
    return f" ± {number(mcse / error['before'], 1)} by Monte Carlo" if shown else ""


def _residual(report: Report, when: str) -> str:
    tests, unit = report["residual"][when], report["held_out_error"]["unit"]
    count, failed = len(tests["channels"]), tests["failed"]
    outcome = (
        f"fails {len(failed)} of {count} tests: {failures(failed)}" if failed else f"passes all {count} tests"
    )
    # no law predicts it, so that this RMS is no measure of a law next to the one before
    apart = when == "after" and "random_force" in report["candidates"][0]["effects"]
    about = ", what the random force moves taken out" if apart else ""
    return f"RMS {number(tests['rms'], 3)} {unit}{about}; {outcome}"


def _frequency(report: Report) -> str:
    found, unit = report["frequency"], report["friction_after"]["unit"]
    text = (
        f"{number(found['mean'], 6)} ± {number(found['sd'], 2)} {found['unit']}, "
        f"declared {number(found['declared'], 6)} {found['unit']}"
    )
    if found["from_mass"] is None:
        return text
    trusted, moving = found["trusted"], "inertia" if unit == "N m" else "mass"
    meaning = "its interval spans both" if trusted is None else f"the {trusted} is trusted"
    return (
        f"{text}\nfriction is {number(found['from_stiffness'])} {unit} with the declared stiffness, "
        f"{number(found['from_mass'])} {unit} with the declared {moving}; {meaning}"
    )


def _noise(noise: Mapping[str, Any], unit: str) -> str:
    text = f"sd {number(noise['sd'], 3)} {unit}, "
    rounding = (noise.get("step") or 0.0) / math.sqrt(12.0)
    if rounding > _NOTABLE_ROUNDING * noise["sd"]:
        share = number(noise["sd"] / rounding, 3)
        text += f"{share} times what rounding to steps of {number(noise['step'], 3)} {unit} leaves; "
    behind = behind_filter(noise.get("filter"))
    if noise["model"] == "white":
        return text + "white" + behind
    if noise.get("order") == 0:
        return text + "weaker far above the motion's frequency, evaluated as if as strong as near it" + behind
    order = f" of order {noise['order']}" if noise.get("order") else ""
    length = number(noise["correlation_length_s"], 3)
    return text + f"autoregressive{order}, correlated over {length} s{behind}"


def _random_force(report: Report) -> str:
    force = report["random_force"]
    sd, time, probable = force["sd"], force["correlation_time_s"], force["probability"]
    stated = f"probability {percent(probable)}; {'' if probable > 0.5 else 'if there, '}"
    share = of_friction(force["share_of_friction"], report["friction_after"]["interval90"])
    return (
        f"{'if there, ' if report['verdict'] == UNEXPLAINED else stated}"
        f"sd {number(sd['mean'], 3)} ± {number(sd['sd'], 2)} {sd['unit']} over all candidates"
        f"{share}, correlated over {number(time['mean'], 2)} s"
    )


def _witnesses(witnesses: Mapping[str, Any]) -> str:
    outcome = "they agree"
    if not witnesses["agree"]:
        outcome = (
            "loss and shape estimates disagree: an error of the sensor that follows the direction of motion, "
            "or an effect that the law lacks; trust the loss of amplitude"
        )
    return (
        f"{with_interval(witnesses['loss'])} by the loss of amplitude\n"
        f"{with_interval(witnesses['shape'])} by the shape within a cycle\n{outcome}"
    )


def _sensitivity(shifts: Mapping[str, float | None]) -> str:
    """How far friction depends on how large effects were taken to be beforehand."""
    widths = {"narrow": shifts["0.1"], "wide": shifts["10"]}
    moves = [
        f"by {number(shift, 2)} sd with priors of effects ten times as {width}"
        for width, shift in widths.items()
        if shift is not None
    ]
    unknown = " or as ".join(width for width, shift in widths.items() if shift is None)
    if not moves:
        return (
            "how far friction moves with priors of effects ten times as "
            f"{unknown} cannot be computed from these draws"
        )
    text = f"friction would move {' and '.join(moves)}"
    return f"{text}; ten times as {unknown}: cannot be computed from these draws" if unknown else text


def _dry_friction(dry: Mapping[str, Any], interval90: Sequence[float]) -> str:
    limit = f"95 % upper limit {number(dry['upper95'], 2)} {dry['unit']}"
    if dry["probability"] < _UNSEEN:
        if interval90[0] > 0.0:
            return f"acts, and takes a small part of the loss; {limit}"
        return f"none can be seen; {limit}" if dry["upper95"] else "none can be seen"
    matters = f"matters with a probability of {percent(dry['probability'])}"
    return f"{matters}; {limit}" if dry["probability"] < _CERTAIN else matters


def _left(report: Report) -> str:
    left, unit = report["left"], report["friction_after"]["unit"]
    if not left["structured_rms"] and not left["depends_on"]:
        noise = "" if report["verdict"] != "unexplained" else ", yet it is no noise: see the tests that fail"
        return f"nothing that follows the motion{noise}"
    on = f"a force that depends on the {left['depends_on']}: " if left["depends_on"] else ""
    if report["friction_between_records"] is not None:
        on = f"in {left['record']}: {on}"
    text = (
        f"{on}{number(left['structured_rms'], 2)} {left['unit']} of the signal "
        f"({number(100.0 * left['share_of_amplitude'], 2)} % of the amplitude); friction could shift by "
        f"{number(left['friction_could_shift_by'], 2)} {unit}"
    )
    return f"{text}\n{_shape(left)}" if left["shape"] else text


def _shape(left: Mapping[str, Any]) -> str:
    share = percent(left["share"])
    if left["share"] < _LEAST_SHARE:
        return f"no simple shape describes it: the best of those tried, {left['shape']}, takes {share} of it"
    return f"of the simple shapes tried, {left['shape']} describes it best: {share} of it"


def _like(left: Mapping[str, Any]) -> str:
    known = left["shape"] and left["share"] >= _LEAST_SHARE
    return f", {percent(left['share'])} of it like {left['shape']}" if known else ""


def paper_words(report: Report) -> str:
    """What the paper's own procedure gives, and why it differs."""
    procedure = report["paper_procedure"]
    if procedure["friction"] is None:
        return f"no result: {procedure.get('why') or 'refused'}"
    found = [] if report["verdict"] == UNEXPLAINED else report["effects"]
    effects = {effect["name"]: percent(effect["probability"]) for effect in found}
    # a wide interval makes nothing disagree
    reasons = [
        f"{words(name)} ({effects[name]})" if name in effects else _FAULTS.get(name, words(name))
        for name in procedure["because"]
        if name != _TOO_WIDE
    ]
    word, why = ("disagrees", "because") if procedure["disagrees"] else ("agrees", "in spite")
    text = f"{with_interval(procedure['friction'])}\n{word}"
    text += f", {why} of {listed(reasons)}" if reasons else ""
    wide = "; its interval is too wide, as successive drops share a peak"
    return text + wide if _TOO_WIDE in procedure["because"] else text


def _reference(check: Mapping[str, Any], unit: str) -> str:
    inside = "inside" if check["within_interval90"] else "outside"
    return (
        f"{number(check['friction'])} {unit}, {inside} the 90 % interval; "
        f"error {100.0 * check['error_before']:+.2g} % before, {100.0 * check['error_after']:+.2g} % after"
    )


def _force(report: Report) -> str:
    force = report["residual"]["force"]
    before, after, level = (number(force[name], 3) for name in ("before", "after", "level"))
    unit = force["unit"]
    lines = [
        f"RMS difference {before} {unit} before, {after} {unit} after; mean during the motion {level} {unit}"
    ]
    law, fluctuation = force["explained_by_law"], force["explained_with_fluctuation"]
    if law is not None:
        lines.append(f"the law alone explains {percent(max(law, 0.0))} of its variance")
    if fluctuation is not None:
        lines[-1] += f", with the fluctuation {percent(max(fluctuation, 0.0))}"
    return "\n".join(lines)


def sampler_lines(sampler: Mapping[str, Any]) -> list[str]:
    """What the sampler found, and whether it agrees with the closed form."""
    if "friction" not in sampler:
        return [sampler["because"]]
    word = {True: "agrees with", False: "DOES NOT AGREE with", None: "CANNOT BE COMPARED with"}[
        sampler["agrees"]
    ]
    lines = [
        with_interval(sampler["friction"]),
        f"R-hat {number(sampler['rhat'], 5)}, effective sample size {number(sampler['ess_bulk'], 5)}; "
        f"{word} the closed form of the part that was sampled",
    ]
    if not sampler["agrees"]:
        lines.append(sampler["because"])
    if "sampler_s" in sampler:
        lines.append(f"took {duration(sampler['sampler_s'])}")
    return lines
