"""The rounds of one record, until its law has converged, under alternatives for its residual.

A law converges without a random force first, and from the motion of Coulomb friction where the smoothed one
does not lead to white residuals; where these are not white, or a force is more probable, it converges with a
force too, and the larger evidence decides. Alternatives to both are coloured noise, where the spectrum shows
it, corners that the sensor has shaped, and a filter that the record went through, behind which the noise has
a colour too. The force is searched for knocks. Laws with a friction drift, or with a zero that moves along a
curve, are compared with those that are reached without. At last, under any other noise than white, the most
probable law converges once more, the noise nowhere below its level near the motion's frequency.
"""

from __future__ import annotations

from functools import reduce

import numpy as np

from friction_bayes.loop.columns.law_columns import SENSOR_ZERO
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.infer.coulomb_fit import CoulombStart, coulomb_start
from friction_bayes.loop.infer.high_pass_starts import high_pass_starts
from friction_bayes.loop.infer.noise_kinds import evaluate_sensor_noise
from friction_bayes.loop.infer.rounds import Round
from friction_bayes.loop.noise.correlated_noise import is_coloured
from friction_bayes.mechanics.effects.curved_friction_drift import CURVED_FRICTION_DRIFT
from friction_bayes.mechanics.effects.curved_sensor_drift import CURVED_SENSOR_DRIFT
from friction_bayes.mechanics.effects.friction_drift import FRICTION_DRIFT

__all__ = ["settle"]

_DRIFTS = {FRICTION_DRIFT.name, CURVED_FRICTION_DRIFT.name}
_MOST_ROUNDS = 5
"""Until a law has converged; up to as many again as long as each is more probable than the one before, and
with every knock that is admitted."""
_MOST_HALVES = 2
"""Of a step between rounds."""
_ALIKE = 1.0
"""Log evidence within which rounds of one law differ."""
_MOST_LOOKS = 12
"""For a knock, each of which may take a few: a record that requires more is not knocked by accident."""
_MOST_FILTERS = 3
"""Until the same filter is found again along the motion behind it."""


def settle(whole: MovingRecord, *, filters: bool = True) -> Round | None:
    """The round in which the law of a record has converged and the force requires no other knock.

    None where one holds too few turning points. No filter is looked for behind one that is known, or without
    ``filters``. A zero that moves along a curve may take what is of the force: a law with one is compared
    with the one that is reached without.
    """
    latest = _converged(whole, filters=filters)
    if latest is not None and not latest.is_dry_friction_alone and CURVED_SENSOR_DRIFT.name in latest.acting:
        straight = _converged(whole.without_effects({CURVED_SENSOR_DRIFT.name}), filters=filters)
        latest = _better(latest, None if straight is None else _settled(straight.among(whole.allowed)))
    return _with_noise_near_motion(latest)


def _with_noise_near_motion(latest: Round | None) -> Round | None:
    """The law under noise nowhere below its level near the motion's frequency, unless noise is white.

    That is more noise than the samples show, so that its evidence is compared with no other.
    """
    if latest is None or not latest.is_shaped:
        return latest
    return _with_knocks(_settled(latest.in_its_colour_near_motion()) or latest)


def _converged(whole: MovingRecord, *, filters: bool) -> Round | None:
    """The law in which the rounds of a record end, the noise as it is most probable."""
    first = Round.starting(whole, *whole.first_motion())
    still = _settled(first)
    if whole.filter is not None:
        return still
    coulomb = None
    if still is None or not still.with_force.leaves_nothing:
        # step by step a law may not reach an optimum far from its start
        coulomb = coulomb_start(whole)
        still = _better(still, _settled(_about_coulomb(whole, coulomb)))
    still = _better(still, _without_drift(still))
    latest = _with_force(first, still)
    if latest is not None and still is not None and whole.noise != "white":
        latest = _under_other_noise(latest, still, coulomb, filters=filters)
    return latest if latest is None or latest.is_shaped else _with_knocks(latest)


def _about_coulomb(whole: MovingRecord, start: CoulombStart | None) -> Round | None:
    return None if start is None else Round.starting(whole, *start)


def _without_drift(still: Round | None) -> Round | None:
    """The law that is reached by way of laws in which nothing of friction changes with time.

    A friction drift imitates a loss that depends on the velocity, and along the motion of the one the other
    is less probable. None where the law has no drift.
    """
    if still is None or not still.acting & _DRIFTS:
        return None
    steady = _settled(still.among(still.whole.without_effects(_DRIFTS).allowed))
    return None if steady is None else _settled(steady.among(still.whole.allowed))


def _with_force(first: Round | None, still: Round | None) -> Round | None:
    """The law where a force may go with the motion, by the one or the other start."""
    latest = None if still is None else still.with_force
    if first is None or (latest is not None and latest.leaves_nothing):
        return latest
    free = _settled(first.with_force)
    # along its own, exact motion a law does not need the force that made up for an inexact one
    return free if still is None or _better(still, free) is free else latest


def _under_other_noise(latest: Round, still: Round, coulomb: CoulombStart | None, *, filters: bool) -> Round:
    """The most probable of a law, the same behind a filter, under coloured noise, and with free corners.

    The spectra have compared a filter with noise of any other colour: what holds behind it is not compared
    with that again.
    """
    sought, best = filters and not latest.is_dry_friction_alone, latest
    # a low pass is not hidden by a high pass of its drift
    for high_passes in (False, True) if sought and still.whole.noise == "auto" else ():
        behind = _behind_filter(still, coulomb, high_passes=high_passes)
        if behind is not None and not _holds_against(latest, behind):
            best = behind
            break
    else:
        coloured = _coloured(still, coulomb)
        if coloured is not None and (still.whole.noise == "ar" or not _holds_against(latest, coloured)):
            best = coloured
    shaped = _settled(still.with_free_corners()) if sought else None
    return best if shaped is None or _holds_against(best, shaped) else shaped


def _with_knocks(latest: Round | None) -> Round | None:
    """The law with knocks of the force, as many as it requires; with none where it requires too many."""
    looks = _MOST_LOOKS if latest is not None and latest.found.prior.none < 1.0 else 0
    while latest is not None and looks > 0:
        jump = latest.next_knock()
        if jump is None:
            return latest
        looks = looks - 1 if jump.any() else 0
        latest = _settled(latest.jumping(jump if looks > 0 else np.zeros_like(jump)))
    return latest


def _coloured(still: Round, coulomb: CoulombStart | None) -> Round | None:
    """The law under coloured noise; None where the spectrum shows none, and none is requested.

    What effects imitated of the colour under white noise they may keep: a second start is from none.
    """
    decay, whole = still.whole.segment.decay, still.whole
    if whole.noise != "ar" and not is_coloured(still.left, decay.step, decay.frequency):
        return None
    none = whole.without_effects(set(whole.effects) - SENSOR_ZERO)
    plain = _about_coulomb(none, coulomb)
    coloured = None if plain is None else plain.in_its_colour()
    return _better(
        _settled(still.in_its_colour()),
        None if coloured is None else _settled(coloured.among(whole.allowed)),
    )


def _behind_filter(still: Round, coulomb: CoulombStart | None, *, high_passes: bool) -> Round | None:
    """The law behind the filter that a record went through; None without one.

    The filter is found along the motion of Coulomb friction, and anew along the motion behind it.
    """
    latest, best = _about_coulomb(still.whole, coulomb) or still, None
    for look in range(_MOST_FILTERS):
        if look == 0 and high_passes and coulomb is not None:
            behind = high_pass_starts(still.whole, coulomb)
        else:
            behind = latest.behind_filters(high_passes=high_passes)
        if latest.whole.filter in [each.whole.filter for each in behind]:
            break
        settled = reduce(_better, map(_settled, behind), None)
        if settled is None:
            break
        latest, best = settled, _better(best, settled)
    if best is None:
        return None
    return _better(best, _settled(best.in_its_colour()))


def _holds_against(one: Round, other: Round) -> bool:
    """Whether a round is more probable than another, on the samples that both have.

    It has noise that grows with the motion where that is more probable, and the lines that were found with
    the other.
    """
    lines = other.found.lines
    if not {line.effect for line in lines} <= {line.effect for line in one.found.lines}:
        one = _better(one, _settled(one.with_lines(lines))) or one
    mine, its = _on_common_samples(one, other)
    if its.log_evidence <= mine.log_evidence:
        return True
    noise = evaluate_sensor_noise(mine.found, mine.found)[2]
    return its.log_evidence <= mine.log_evidence + noise.log_total


def _better(one: Round | None, other: Round | None) -> Round | None:
    """The round of the larger evidence, on the samples that both have."""
    if one is None or other is None:
        return one or other
    mine, its = _on_common_samples(one, other)
    return one if mine.log_evidence >= its.log_evidence else other


def _on_common_samples(one: Round, other: Round) -> tuple[Round, Round]:
    """Two rounds on the samples that neither sets aside."""
    used = one.found.clock.used & other.found.clock.used
    return one.without(~used), other.without(~used)


def _settled(latest: Round | None) -> Round | None:
    """The round after which the next agrees, or the most probable of those tried.

    A law is as probable as it is along its own motion: of one that the next does not agree with, the next
    along that motion says how much, where it is less probable.
    """
    if latest is None:
        return None
    tried: Round | None = None
    for rounds in range(2 * _MOST_ROUNDS):
        following = _next(latest)
        if following is None or latest.stays(following):
            return following or tried
        falls = _better(latest, following) is latest
        tried, latest = _better(tried, following if falls else latest), following
        if falls and rounds >= _MOST_ROUNDS - 1:
            break
    return tried


def _next(before: Round) -> Round | None:
    """The next round, a half or a quarter as far where a whole step leads to a less probable law.

    A law is linear only about a motion near its own, and far from it steps may go to and fro.
    """
    following = step = before.following()
    for _ in range(_MOST_HALVES):
        if step is None or not _loses(step, before):
            break
        step = step.half_as_far(before)
        following = _better(following, step)
    return following


def _loses(one: Round, other: Round) -> bool:
    """Whether a round is less probable than another, by more than what rounds of one law differ by."""
    mine, its = _on_common_samples(one, other)
    return mine.log_evidence < its.log_evidence - _ALIKE
