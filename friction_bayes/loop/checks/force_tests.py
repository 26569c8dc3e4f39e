"""Whether the residual of a law and a random force is noise, or follows the motion.

A random force takes up whatever moves the oscillator. Whether it depends on the motion is tested by forces in
addition to the law: binned functions of the velocity, the position, the amplitude and the time, whitened like
every column. One that passes is random; one that fails and is large is an effect outside the catalogue.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import stats

from friction_bayes.core.arrays import Array
from friction_bayes.loop import settings
from friction_bayes.loop.checks.added_forces import ScoreTest, added_forces
from friction_bayes.loop.checks.force_shapes import ForceShape, best_shape, stops
from friction_bayes.loop.checks.noise_tests import Channel, ResidualTests, noise_tests
from friction_bayes.loop.infer.knocks import jump_tails
from friction_bayes.loop.infer.record_fit import ForceFit

__all__ = ["Dependence", "LeftOver", "what_is_left"]

_JUMPS = "force_jumps"


@dataclass(frozen=True)
class Dependence:
    """Dependence of the residual force on a variable.

    Attributes
    ----------
    on : str
        ``velocity``, ``position``, ``amplitude`` or ``time``.
    channel : Channel
        Its test.
    force : float
        Root mean square of that part of the force, its own uncertainty taken off, natural units.
    friction : float
        Friction that would take as much energy out of the motion as that part does, natural units.
    signal : float
        The same root mean square of what it adds to the innovations, in the unit of the signal.
    """

    on: str
    channel: Channel
    force: float
    friction: float
    signal: float


@dataclass(frozen=True, eq=False)
class LeftOver(ResidualTests):
    """Tests of the innovations and of the force; ``rms`` is that of the innovations.

    Attributes
    ----------
    dependences : tuple of Dependence
    near_motion : float
        Lower limit of the innovations' standard deviation near the frequency of the motion, over the model's,
        with the probability of credible candidates.
    shape : ForceShape or None
        That describes the worst dependence best; None without one.
    """

    dependences: tuple[Dependence, ...]
    near_motion: float
    shape: ForceShape | None = None

    @property
    def jumps(self) -> float | None:
        """Kurtosis of the jumps of the random force where they are not normal; None where they may be."""
        if _JUMPS not in self.failed:
            return None
        return next(channel.statistic for channel in self.channels if channel.name == _JUMPS)

    @property
    def worst(self) -> Dependence | None:
        """The largest dependence that fails its test."""
        failed = [d for d in self.dependences if d.channel.name in self.failed]
        return max(failed, key=lambda d: d.force, default=None)

    def matters(self, tolerance: float, friction: float) -> bool:
        """Whether the residual is too large for friction to be estimated.

        It is where a force that depends on the motion is larger than the tolerance's share of ``friction``
        (natural units), or where innovations that are not noise exceed the model's by that share near the
        frequency of the motion: elsewhere they are the sensor's, and no evidence about the law. Jumps of the
        random force that are not normal are reported and decide nothing.
        """
        if self.worst is not None and self.worst.force > tolerance * friction:
            return True
        coloured = "whiteness" in self.failed or "spectrum" in self.failed
        return coloured and self.near_motion > 1.0 + tolerance

    def to_left(self) -> dict[str, Any]:
        """The worst dependence as reported: ``depends_on``, ``shape`` and its ``share``."""
        return {
            "depends_on": None if self.worst is None else self.worst.on,
            "shape": None if self.shape is None else self.shape.name,
            "share": None if self.shape is None else self.shape.share,
        }


def what_is_left(fit: ForceFit) -> LeftOver:
    """Tests of the residual of the best law and its random force."""
    x = fit.innovations[fit.clock.used]
    binned = dict(_binned_forces(fit))
    best = fit.posterior.best
    kurtosis, independent, p_value = jump_tails(fit.regression, fit.coefficients, best)
    jumps = Channel(_JUMPS, kurtosis, int(independent), p_value)
    dependences = (
        *(_dependence(fit, on, bins) for on, bins in binned.items()),
        _one_of(fit, "friction_by_position", binned["position"][:, settings.SETTINGS.travel_bins :]),
        _one_of(fit, "force_by_stop", stops(fit.path)[1]),
    )
    left = LeftOver(
        channels=(*noise_tests(x), jumps, *(d.channel for d in dependences)),
        dependences=dependences,
        near_motion=_near_motion(fit, x),
        rms=float(best.noise * fit.record.error.share * fit.unit * np.sqrt(np.mean(x**2))),
    )
    return left if left.worst is None else replace(left, shape=best_shape(fit, binned[left.worst.on]))


def _near_motion(fit: ForceFit, innovations: Array) -> float:
    """Least standard deviation of the innovations about the motion's frequency, over the model's.

    Over the ordinates of the spectrum whose nearest harmonic it is: friction acts at odd ones alone. The sum
    of the ordinates of a periodogram, over half their mean, is a chi-square of two degrees for each.
    """
    power = np.abs(np.fft.rfft(innovations - innovations.mean())) ** 2 / innovations.size
    order = np.fft.rfftfreq(innovations.size, fit.segment.decay.step) * 2.0 * math.pi / fit.w0
    inside = np.rint(order) == 1.0
    degrees = 2 * int(np.count_nonzero(inside))
    if degrees == 0:
        return 1.0
    likely = float(stats.chi2.ppf(settings.SETTINGS.credible_mass, degrees))
    return math.sqrt(2.0 * float(power[inside].sum()) / likely)


def _binned_forces(fit: ForceFit) -> Iterator[tuple[str, Array]]:
    """Forces at the nodes of the path: one a bin, and with the direction of motion where that differs."""
    path = fit.path
    sign = path.direction[:, None]
    turns = path.turning_x - np.mean(0.5 * (path.turning_x[1:] + path.turning_x[:-1]))
    amplitude = np.interp(path.node_phase, path.turning, np.abs(turns))
    bins = settings.SETTINGS.travel_bins
    yield "velocity", _indicator(path.node_v, 2 * bins)
    position = _indicator(path.node_x, bins)
    yield "position", np.hstack([position, sign * position])
    yield "amplitude", sign * _indicator(amplitude, bins)
    yield "time", sign * _indicator(path.node_phase, settings.SETTINGS.bins)


def _indicator(values: Array, bins: int) -> Array:
    """Which of equally wide bins each value lies in, shape (n, bins)."""
    low, high = float(values.min()), float(values.max())
    which = np.minimum(((values - low) / max(high - low, 1e-300) * bins).astype(int), bins - 1)
    return np.asarray(which[:, None] == np.arange(bins), dtype=np.float64)


def _dependence(fit: ForceFit, on: str, forces: Array) -> Dependence:
    found = added_forces(fit, forces).test(slice(None))
    statistic, degrees = found.statistic, found.degrees
    channel = Channel(f"force_by_{on}", statistic, degrees, float(stats.chi2.sf(statistic, max(degrees, 1))))
    return _of_force(fit, on, channel, forces, found)


def _one_of(fit: ForceFit, name: str, forces: Array) -> Dependence:
    """The force of several with the largest test statistic: a joint test would hide it."""
    added = added_forces(fit, forces)
    count = forces.shape[1]
    tests = [added.test(slice(j, j + 1)) for j in range(count)]
    j = max(range(count), key=lambda k: tests[k].statistic)
    found = tests[j]
    # the largest of as many
    p = -math.expm1(count * math.log1p(-min(float(stats.chi2.sf(found.statistic, 1)), 1.0 - 1e-16)))
    channel = Channel(name, found.statistic, 1, p)
    return _of_force(fit, "position", channel, forces[:, j : j + 1], found)


def _of_force(fit: ForceFit, on: str, channel: Channel, forces: Array, found: ScoreTest) -> Dependence:
    """The dependence by the forces that a test found, in root mean square."""
    best, coefficients = fit.posterior.best, found.coefficients
    share = fit.path.node_weight / fit.path.node_weight.sum()
    weighted = forces.T @ (forces * share[:, None])
    square = float(coefficients @ weighted @ coefficients - np.sum(weighted * found.covariance))
    signal = best.noise * fit.unit * math.sqrt(max(found.statistic - found.degrees, 0.0) / fit.record.samples)
    power = float((share * fit.path.node_v) @ (forces @ coefficients))
    friction = abs(power) / float(share @ np.abs(fit.path.node_v))
    return Dependence(on, channel, math.sqrt(max(square, 0.0)), friction, signal)
