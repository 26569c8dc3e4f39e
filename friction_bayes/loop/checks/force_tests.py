"""Whether the residual of a law and a random force is noise, or follows the motion, and in what shape.

A random force takes up whatever moves the oscillator. Whether it depends on the motion is tested by forces in
addition to the law, all else of it free: binned functions of the velocity, the position, the amplitude and
the time, whitened like every column. One that passes is random; one that fails and is large is an effect
outside the catalogue, described by the simple form that explains most of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import stats

from friction_bayes.core.arrays import Array
from friction_bayes.loop import settings
from friction_bayes.loop.checks.noise_tests import Channel, ResidualTests, noise_tests
from friction_bayes.loop.infer.knocks import jump_tails
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.statespace.measured_path import MeasuredPath

__all__ = ["LeftOver", "best_shape", "stops", "what_is_left"]

_JUMPS = "force_jumps"
_LENGTHS = (0.01, 0.03, 0.1, 0.3)
"""Over the median amplitude: how far after a turning point a pulse reaches."""
_PLACES = np.linspace(-0.9, 0.9, 13)
"""Place of a bump over the largest displacement."""
_STOPS = np.linspace(0.1, 0.8, 8)
"""Where a spring may begin that the motion meets on one side, likewise."""


class ScoreTest(NamedTuple):
    """Chi-square test of f forces at once, and their coefficients by least squares, with the covariance.

    Degrees of freedom are the combinations of the forces that can be distinguished from the law.
    """

    statistic: float
    degrees: int
    coefficients: Array
    covariance: Array


class AddedForces(NamedTuple):
    """Whitened products of f forces and the residual, in standard deviations of the noise.

    Lengths of the forces before anything is taken from them, (f,), and products of their residuals after the
    law with each other, (f, f), and with the residual, (f,).
    """

    norm: Array
    gram: Array
    score: Array

    def test(self, chosen: slice) -> ScoreTest:
        """Test of some of the forces together."""
        norm = self.norm[chosen]
        values, vectors = np.linalg.eigh(self.gram[chosen, chosen] / np.outer(norm, norm))
        kept = values > settings.SETTINGS.minor_share
        b = vectors[:, kept].T @ (self.score[chosen] / norm)
        basis = vectors[:, kept] / norm[:, None]
        return ScoreTest(
            statistic=float(np.sum(b * b / values[kept])),
            degrees=int(kept.sum()),
            coefficients=basis @ (b / values[kept]),
            covariance=basis @ np.diag(1.0 / values[kept]) @ basis.T,
        )

    def with_law(self, j: int) -> AddedForces | None:
        """The same with force ``j`` as part of the law; None where the law explains it already."""
        own = self.gram[j, j]
        if own <= settings.SETTINGS.minor_share * self.norm[j] ** 2:
            return None
        share = self.gram[j] / own
        return AddedForces(
            self.norm, self.gram - np.outer(share, self.gram[j]), self.score - share * self.score[j]
        )


def added_forces(fit: ForceFit, forces: Array) -> AddedForces:
    """Whitened forces, shape (nodes, f), with the best law projected out."""
    best = fit.posterior.best
    law = np.flatnonzero(fit.regression.sets[fit.chosen])
    # the force itself at the samples: the mean over the nodes of the interval before
    at_samples = np.zeros((fit.path.phase.size, forces.shape[1]))
    if np.any(fit.regression.row[..., 2]):
        np.add.at(at_samples, fit.path.interval + 1, forces * fit.path.node_weight[:, None])
        at_samples[1:] /= np.diff(fit.path.phase)[:, None]
    of_law = fit.law.sensor[:, law] * fit.regression.scale[law]
    block = np.column_stack([of_law, fit.shown(forces, at_samples), fit.residual])
    gram = fit.regression.products(block, best) / best.noise**2
    p = law.size
    known = gram[:p, :p] + np.eye(p)
    rest = gram[p:, p:] - gram[:p, p:].T @ np.linalg.solve(known, gram[:p, p:])
    norm = np.sqrt(np.maximum(np.diag(gram)[p:-1], 1e-300))
    return AddedForces(norm, rest[:-1, :-1], rest[:-1, -1])


@dataclass(frozen=True)
class Dependence:
    """Dependence of the residual force on velocity, position, amplitude or time.

    That part of the force is given by its root mean square, its own uncertainty taken off, and by the
    friction that would take as much energy out of the motion, both in natural units; and by what it adds to
    the innovations, root mean square in the unit of the signal.
    """

    on: str
    channel: Channel
    force: float
    friction: float
    signal: float


@dataclass(frozen=True, eq=False)
class LeftOver(ResidualTests):
    """Tests of the innovations and of the force; ``rms`` is that of the innovations.

    Near the motion's frequency their standard deviation over the model's is known by a lower limit, with the
    probability of credible candidates. The shape describes the worst dependence best.
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
    of the ordinates of a periodogram, over half their mean, is a chi-square of two degrees for each; where
    samples are not used, which count as zero in their places, of as many fewer.
    """
    step = fit.segment.decay.step
    place = np.rint(fit.segment.time[: fit.clock.used.size][fit.clock.used] / step).astype(int)
    even = np.bincount(place, innovations - innovations.mean())
    order = np.fft.rfftfreq(even.size, step) * 2.0 * math.pi / fit.w0
    inside = np.rint(order) == 1.0
    degrees = 2.0 * float(np.count_nonzero(inside)) * innovations.size / even.size
    if degrees == 0.0:
        return 1.0
    power = np.abs(np.fft.rfft(even)[inside]) ** 2 / innovations.size
    likely = float(stats.chi2.ppf(settings.SETTINGS.credible_mass, degrees))
    return math.sqrt(degrees * float(power.mean()) / likely)


def _binned_forces(fit: ForceFit) -> Iterator[tuple[str, Array]]:
    """Forces at the nodes of the path: one a bin, and with the direction of motion where that differs."""
    path = fit.path
    sign = path.direction[:, None]
    amplitude = np.interp(path.node_phase, path.turning, np.abs(path.turning_x - _middle(path)))
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


class ForceShape(NamedTuple):
    """A simple form of a force, in words with an article, and the share that it takes, 0 to 1.

    Of what depends on the motion, in chi-square beyond its expectation.
    """

    name: str
    share: float


def best_shape(fit: ForceFit, binned: Array) -> ForceShape | None:
    """The form that, as a part of the law, explains most of a binned force in its residual, shape (nodes, f).

    None where the law contains all of the forms already, as one with sensor effects can.
    """
    names, columns = zip(*_shapes(fit.path), strict=True)
    bins = slice(0, binned.shape[1])
    added = added_forces(fit, np.column_stack([binned, *columns]))
    whole = added.test(bins)
    # with a single bin that fails, all of them together may pass
    excess = max(whole.statistic - whole.degrees, whole.degrees)
    found = []
    for j, name in enumerate(names, start=binned.shape[1]):
        taken = added.with_law(j)
        if taken is None:
            continue
        drop = whole.statistic - taken.test(bins).statistic
        found.append(ForceShape(name, min(max(drop / excess, 0.0), 1.0)))
    return max(found, key=lambda shape: shape.share, default=None)


def _shapes(path: MeasuredPath) -> Iterator[tuple[str, Array]]:
    """Name and force at the nodes of the path; one name may have several places or lengths."""
    sign, v, middle = path.direction, path.node_v, _middle(path)
    x, turns = path.node_x - middle, np.abs(path.turning_x - middle)
    yield "dry friction", sign
    yield "a force proportional to the velocity", v
    yield "a force proportional to the square of the velocity", np.abs(v) * v
    yield "a force proportional to the displacement", x
    yield "friction proportional to the displacement", sign * x
    yield "friction proportional to the distance from the middle", sign * np.abs(x)
    yield "friction proportional to the amplitude", sign * np.interp(path.node_phase, path.turning, turns)
    yield "friction that changes steadily with time", sign * path.node_phase
    before = np.searchsorted(path.turning, path.node_phase, side="right") - 1
    travelled = np.where(before < 0, np.inf, np.abs(path.node_x - path.turning_x[np.maximum(before, 0)]))
    for length in _LENGTHS:
        yield "a pulse after each turning point", sign * np.exp(-travelled / (length * np.median(turns)))
    reach = float(np.max(np.abs(x)))
    for place in _PLACES:
        bump = np.exp(-0.5 * ((x / reach - place) * settings.SETTINGS.travel_bins) ** 2)
        yield f"a bump {_where(place)}", bump
        yield f"friction that is larger {_where(place)}", sign * bump

    places, springs = stops(path)
    for place, spring in zip(places, springs.T, strict=True):
        yield f"a spring that begins {_where(place)}", spring


def stops(path: MeasuredPath) -> tuple[Array, Array]:
    """Springs that begin at one position, met from one side: places, shape (f,), and forces, (nodes, f).

    Places are over the largest displacement from the middle; the spring lies beyond.
    """
    x = path.node_x - _middle(path)
    places = np.concatenate([_STOPS, -_STOPS])
    beyond = np.sign(places) * x[:, None] / np.max(np.abs(x)) - np.abs(places)
    return places, np.maximum(beyond, 0.0)


def _middle(path: MeasuredPath) -> float:
    """Of the motion: the mean between successive turning points."""
    return float(np.mean(0.5 * (path.turning_x[1:] + path.turning_x[:-1])))


def _where(place: float) -> str:
    if abs(place) * settings.SETTINGS.travel_bins < 1.0:
        return "in the middle"
    return f"at {place:+.2f} of the largest displacement"
