"""A drift of the sensor's zero along a line: how fast, where a record rather has one."""

from __future__ import annotations

from friction_bayes.estimators.noise.coulomb_regression import DRIFT, LEAST_SAMPLES, PlainDecay, PreparedDecay

__all__ = ["zero_drift"]


def zero_drift(decay: PlainDecay) -> float:
    """Rate of a drift, unit of the signal a second; zero where there is rather none.

    A line is nearly orthogonal to a decay of several half cycles: taken out where it is none it costs 2 % of
    what is known of friction; left in it passes for a random force. It is so to losses within a half cycle
    too, those that have a shape, which are not evaluated.

    Parameters
    ----------
    decay : PlainDecay
    """
    if decay.rest_known or not decay.usable:
        return 0.0
    prepared = PreparedDecay(decay)
    if prepared.signal.size < LEAST_SAMPLES:
        return 0.0
    laid = prepared.along_fit().with_losses(prepared, shapes=()).with_drift()
    probability, given = prepared.weighed(laid, DRIFT)
    if probability < 0.5:
        return 0.0
    change = given.coefficient(DRIFT).mean() * laid.unit
    return change / float(prepared.time[-1] - prepared.time[0])
