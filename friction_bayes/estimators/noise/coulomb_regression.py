r"""The Coulomb law as a regression: start, friction, stiffness, rest position, along a motion.

In natural units, about the rest position,

.. math:: x'' = -x - c\,\mathrm{sign}\,v - \kappa x + d

or, for a pendulum, ``x'' = -sin x - c sign v - kappa sin x + d``, with the reference frequency taken from
the fit under white noise: ``kappa`` corrects it. The forces are evaluated along a motion, so that the signal
is linear in start, ``c``, ``kappa`` and rest position. Along the fitted trajectory this is the expansion of
that fit, exact without a random force; along the motion smoothed under a random force it is valid for a force
of any size.

Priors, of the scale of this record: friction ``F`` as fitted under white noise and amplitude ``A``;
``c`` normal with sd 2 F about zero, ``kappa`` 0.05, rest position 0.1 A, start 10 A; the random force as in
:class:`friction_bayes.statespace.force_prior.ForcePrior` about 0.3 F.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.block_means import block_means, samples_in_block, torn_blocks, variance_by_share
from friction_bayes.decay.even_grid import places_on_grid
from friction_bayes.estimators.noise.added_columns import AddedColumns
from friction_bayes.estimators.noise.filter_evidence import FoundFilters, FoundKind, filters_along
from friction_bayes.estimators.noise.free_corners import (
    corner_columns,
    corner_scale,
    near_corners,
)
from friction_bayes.estimators.noise.high_passes import MotionBehind
from friction_bayes.estimators.noise.other_forces import (
    DISTINCT,
    FORCES,
    other_force_columns,
    other_force_sets,
    repeated,
)
from friction_bayes.estimators.noise.recording_filters import (
    RecordingFilter,
    behind,
    determined,
    jump_columns,
    own_columns,
)
from friction_bayes.estimators.noise.smooth_curve import CURVE_SDS, smooth_curve
from friction_bayes.mechanics.coulomb import coulomb_decay
from friction_bayes.records.quantisation import quantisation_step
from friction_bayes.statespace.coloured_noise import Autoregression
from friction_bayes.statespace.force_grid import Posterior, integrate_force
from friction_bayes.statespace.force_prior import ForcePrior
from friction_bayes.statespace.kalman import Clock, sensor_row
from friction_bayes.statespace.measured_path import NEAR_TURN, MeasuredPath
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.regression import LawRegression, frequency_change
from friction_bayes.statespace.response import at_sensor, response_at_sensor
from friction_bayes.statespace.smoother import MOTION_KNOWN_TO, SmoothedMotion, first_motion
from friction_bayes.statespace.transition import initial_response

__all__ = ["CORNER", "DRIFT", "LEAST_SAMPLES", "Laid", "PlainDecay", "PreparedDecay"]

_CENTRE = 0.3
"""Median of the random force's sd over the friction that explains the loss of amplitude."""
_SURELY_SLIDES = 3.0
"""Amplitude over ``r/k`` below which a half cycle may end in sticking, and is left out."""
LEAST_SAMPLES = 12
"""Least number of samples for which accounts are evaluated: twice the coefficients of the law, and two.

Of 300 records of 12 to 62 samples in white noise 272 were covered. With the amplitudes alone in place of the
accounts 195 of the 200 longer ones, and 73 intervals were more than twice as wide as under white noise.
"""
DRIFT = "drift"
"""Name of the column of a drift of the sensor's zero."""
_DRIFT_SHARE, _DRIFTS = 0.1, 0.1
"""Prior sd of such a drift over the amplitude, as that of the rest position, and its probability: it goes
along a line or a curve."""
_OF_MOTION: tuple[str, ...] = ("displacement", "velocity", "friction", "stiffness")
"""Names of the columns of the law that are of the motion, and not of the sensor's zero."""
CORNER = "corner_"
"""Prefix of the names of the columns of free corners."""
_NATURAL = Oscillator(mass=1.0, stiffness=1.0)
_MOST_ROUNDS = 4
"""Motions that are smoothed with a law: one is enough except for a pendulum that swings far."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlainDecay:
    """One decay and the results of its fit under white noise, without a random force.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Samples of the moving part.
    time : ndarray, shape (n,)
        When they were taken, the first at 0 [s].
    order : int
        Order of the derivative measured.
    frequency : float
        Angular frequency [rad/s].
    coefficient : float
        Friction coefficient of the signal, ``u = w0**q r/k``.
    rest_position : float
        Unit of the signal.
    states : ndarray, shape (n, 2)
        Displacement about the rest position and velocity that were fitted, times the power of the frequency
        that gives them the unit of the signal.
    phase_sd : float
        Standard deviation of the phase that was fitted, where it is known least.
    rest_known : bool
        Whether the rest position was given.
    pendulum : bool
        Whether the restoring force is that of a pendulum at large swings.
    noise_sd : float
        Of a sample.
    """

    values: Array
    time: Array
    order: int
    frequency: float
    coefficient: float
    rest_position: float
    states: Array
    phase_sd: float
    rest_known: bool = False
    pendulum: bool = False
    noise_sd: float

    @property
    def step(self) -> float:
        """Mean sampling interval [s]."""
        return float(self.time[-1] / (self.time.size - 1))

    @property
    def block(self) -> int:
        """Number of samples averaged into one; one for an accelerometer, which jumps."""
        per_period = 2.0 * math.pi / (self.frequency * self.step)
        return 1 if self.order == 2 else samples_in_block(per_period)

    @property
    def amplitude(self) -> float:
        """Largest of the signal about its rest position."""
        return float(np.nanmax(np.abs(self.values - self.rest_position)))

    @property
    def usable(self) -> bool:
        """Whether white noise can be separated from anything else here."""
        return (
            # an oscillation that grows is no free decay
            self.coefficient > 0.0
            and self.values.size // self.block >= LEAST_SAMPLES
            and self.frequency * self.step < 0.5 * math.pi
            and self.noise_sd > MOTION_KNOWN_TO * self.amplitude
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Laid:
    """The regression of a decay along a path, in natural units of a frequency [rad/s]."""

    prepared: PreparedDecay
    path: MeasuredPath
    regression: LawRegression
    frequency: float
    filter: RecordingFilter | None = None
    """The filter between the motion and the recording."""

    @property
    def order(self) -> int:
        """Order of the derivative measured."""
        return self.prepared.decay.order

    @property
    def unit(self) -> float:
        """Natural unit in the unit of the signal."""
        return self.frequency**self.order

    @property
    def signal(self) -> Array:
        """The signal in natural units, shape (n,)."""
        return self.prepared.signal / self.unit

    @property
    def read(self) -> Array:
        """The motion as the sensor reads it behind no filter, shape (n,), natural units."""
        found = self.regression
        return np.asarray(found.columns @ (found.scale * found.reference) + self.signal - found.target)

    def with_variance(self, variance: Array) -> Laid:
        """The same with relative variances of the samples, shape (n,), infinite where one is left out."""
        clock = replace(self.regression.clock, variance=variance)
        return replace(self, regression=replace(self.regression, clock=clock))

    def with_noise(self, least: float, colour: Autoregression | None = None) -> Laid:
        """The same under noise of at least so much, white or coloured, natural units."""
        regression = self.regression
        clock = replace(regression.clock, autoregression=colour)
        least = max(least, regression.least_noise)
        return replace(self, regression=replace(regression, clock=clock, least_noise=least))

    def behind(self, filter_: RecordingFilter) -> Laid:
        """The same law behind a filter, with what that has of the time outside the record, and its doubts."""
        regression, path, signal = self.regression, self.path, self.signal
        n = signal.size
        places = path.jump_places(self.order)
        shown = behind(np.column_stack([regression.columns, signal - regression.target]), filter_, places)
        if "rest" in regression.names:
            # zero of the recording, not of the motion
            shown[:, regression.names.index("rest")] = 1.0
        own = own_columns(filter_, self.read)
        # a filter in time hardly shows where between two samples a jump was, and that is known along the path
        jumps = jump_columns(filter_, path.jumps(self.order)[: 0 if filter_.in_time else None], n)
        # friction jumps by its scale, at any place between two samples
        jump = float(regression.scale[regression.names.index("friction")]) / math.sqrt(12.0)
        scale = np.repeat([1.0, jump], [own.shape[1], jumps.shape[1]])
        inside = np.full(n, np.inf)
        inside[determined(filter_, n)] = 1.0
        filtered = replace(regression, columns=shown[:, :-1], target=signal - shown[:, -1])
        added = AddedColumns.shown(("filter",) * scale.size, np.hstack([own, jumps]), scale)
        return (
            replace(self, regression=filtered, filter=filter_)
            ._with(added)
            .with_variance(np.maximum(regression.clock.variance, inside))
        )

    def with_other_forces(self, shapes: tuple[float, ...], *, at_least_one: bool = False) -> Laid:
        """The same under each set of other forces than dry friction, none of them first unless one acts.

        Dry friction is not negative then: it would make up for too much of another loss. What rounds corners,
        as a filter does, is not evaluated behind one, nor a shape from few samples.
        With shapes as :data:`.other_forces.SHAPES` has them.
        """
        regression = self.regression
        # below there is nothing to separate
        least = 2 * (len(regression.names) + DISTINCT) + 2
        few = np.count_nonzero(regression.clock.used) < least
        shapes = () if few or self.filter is not None else shapes
        friction, until = self.prepared.friction, self._until
        added = other_force_columns(self.path, self.regression.row, friction, until, shapes)
        if self.filter is not None:
            places = self.path.jump_places(self.order)
            added = added._replace(sensor=behind(added.sensor, self.filter, places))
        sets, log_prior = other_force_sets(shaped=bool(shapes))
        some = slice(1 if at_least_one else 0, None)
        laid = self._with(added, sets[some], log_prior[some])
        positive = laid.regression.positive.copy()
        positive[laid.regression.names.index("friction")] = True
        alike = repeated(np.ones(len(added.names), np.bool_))
        return replace(laid, regression=replace(laid.regression, positive=positive, alike=alike))

    def of_sets(self, kept: Mask) -> Laid:
        """The same under some of the sets, ``kept`` of shape (m,), without columns that none of these has."""
        sets = self.regression.sets[kept]
        used = np.asarray(sets.any(axis=0))
        regression = replace(
            self.regression.of_columns(used),
            sets=sets[:, used],
            log_prior=self.regression.log_prior[kept],
            alike=repeated(used[self.of_other_forces]),
        )
        return replace(self, regression=regression)

    @property
    def _until(self) -> float:
        """Phase at the end of the decay."""
        return float(self.frequency * self.prepared.decay.time[-1])

    def with_drift(self) -> Laid:
        """The same without a drift of the sensor's zero, with one along a line, and along a curve."""
        curve = smooth_curve(self.regression.clock.phase, self._until)
        scale = _DRIFT_SHARE * float(np.max(np.hypot(self.path.x, self.path.v))) * CURVE_SDS
        sets = np.array([[False] * CURVE_SDS.size, np.arange(CURVE_SDS.size) == 0, [True] * CURVE_SDS.size])
        log_prior = np.log([1.0 - _DRIFTS, 0.5 * _DRIFTS, 0.5 * _DRIFTS])
        return self._with(AddedColumns.shown((DRIFT,) * CURVE_SDS.size, curve, scale), sets, log_prior)

    def _with(self, added: AddedColumns, sets: Mask | None = None, log_prior: Array | None = None) -> Laid:
        """The same with more columns: in every set, or in turn in those of ``sets``, shape (m, k)."""
        regression = self.regression
        if sets is None or log_prior is None:
            sets, log_prior = np.ones((1, len(added.names)), np.bool_), np.zeros(1)
        times = len(regression.sets)
        return replace(
            self,
            regression=replace(
                regression,
                names=(*regression.names, *added.names),
                columns=np.hstack([regression.columns, added.sensor]),
                states=np.concatenate([regression.states, added.states], axis=2),
                scale=np.append(regression.scale, added.scale),
                positive=np.append(regression.positive, added.positive),
                sets=np.hstack([np.repeat(regression.sets, len(sets), axis=0), np.tile(sets, (times, 1))]),
                log_prior=np.add.outer(regression.log_prior, log_prior).ravel(),
            ),
        )

    @property
    def has_free_corners(self) -> bool:
        """Whether corners may have any shape."""
        return any(name.startswith(CORNER) for name in self.regression.names)

    @property
    def kind(self) -> str:
        """Of the law: with corners of any shape, with other forces than dry friction, or neither."""
        if self.has_other_forces:
            return "other forces"
        return "free corners" if self.has_free_corners else "dry friction"

    @property
    def has_other_forces(self) -> bool:
        """Whether others than dry friction act."""
        return bool(self.of_other_forces.any())

    @property
    def of_other_forces(self) -> Mask:
        """Which columns, shape (p,), are of these."""
        return np.array([name in FORCES for name in self.regression.names])

    @property
    def acting(self) -> Mask:
        """Which of :data:`.other_forces.FORCES` act in each set, shape (m, forces)."""
        names, sets = np.array(self.regression.names), self.regression.sets
        return np.column_stack([sets[:, names == name].any(axis=1) for name in FORCES])

    def with_free_corners(self) -> Laid:
        """The same with corners of any shape."""
        path, regression, friction = self.path, self.regression, self.prepared.friction
        columns, scale = corner_columns(path), corner_scale(path, self.order, friction)
        clock = regression.clock
        if self.order == 2:
            jump = (friction / regression.motion.noise) ** 2 * near_corners(path)
            clock = replace(clock, variance=clock.variance + jump)
        names = tuple(f"{CORNER}{j}" for j in range(scale.size))
        laid = replace(self, regression=replace(regression, clock=clock))
        return laid._with(AddedColumns.shown(names, columns, scale))

    def best_law_with(self, name: str) -> tuple[float, Array]:
        """Probability of the sets with a column, and the best law of these, both without a force."""
        found = self.without_force()
        having = self.regression.sets[None, :, self.regression.names.index(name)]
        return float(found.weight[having].sum()), found.among(having).best_law()

    def along_law(self, law: Array, share: float = 1.0) -> Laid:
        """Regression along the motion under a law of these coefficients, shape (p,), without a force.

        Or along one a ``share`` of the way to it.
        """
        regression = self.regression
        motion, change = regression.motion, frequency_change(law[regression.stiffness])
        states = motion.states.copy()
        states[:, :2] += share * (regression.states @ law + regression.known_states - states[:, :2])
        motion = replace(motion, states=states).at_frequency(change)
        return self.prepared.along(motion, self.frequency * change)

    def filters_along(self, *, only: str | None = None) -> FoundFilters:
        """Filters, or only those of one kind, that the samples may have gone through."""
        regression = self.regression
        # noise that is mostly rounding, of whatever spectrum, came after any filter
        if self.prepared.is_rounding or not regression.clock.even:
            return FoundFilters()
        signal = np.where(self.prepared.missing, np.nan, self.signal)
        known = self.signal - regression.target
        friction = regression.names.index("friction")
        return filters_along(self.path, self.order, signal, known, regression.columns, friction, only)

    def behind_kind(self, kind: FoundKind) -> list[tuple[float, Laid]]:
        """Regressions behind filters of a kind, with their probabilities among themselves.

        They go along the motion that the record shows through such a filter; with that motion the size is
        looked for once more, as the first was found along a motion that was fitted without a filter.
        """
        path = self.seen_through(kind.filters[0][1])
        # at another frequency a record that was just long enough may be too short
        filters = path.filters_along(only=kind.name).likely or [(1.0, kind.filters[0][1])]
        path = path.seen_through(filters[0][1])
        return [(share, path.behind(each)) for share, each in filters]

    def motion_behind(self) -> MotionBehind:
        """Log likelihood of the motion and its dry friction behind a filter."""
        regression = self.regression
        moving = np.array([name in _OF_MOTION for name in regression.names])
        signal = np.where(regression.clock.used, self.signal, np.nan)
        known = self.signal - regression.target
        return MotionBehind(signal, known, regression.columns[:, moving], self.path.angle)

    def without_force(self) -> Posterior:
        return integrate_force(Problem.of(self.regression), self.prepared.prior.without_force)

    def seen_through(self, filter_: RecordingFilter) -> Laid:
        """Regression along the motion that explains the record best behind a filter."""
        filtered = self.behind(filter_)
        found = filtered.without_force()
        motion = filtered.regression.motion.of_noise(found.noise_sd)
        filtered = replace(filtered, regression=replace(filtered.regression, motion=motion))
        return filtered.along_law(found.best_law())


class PreparedDecay:
    """A decay in natural units, in means of blocks, up to where it may stick.

    Attributes
    ----------
    signal : ndarray, shape (n,)
        About the rest position, unit of the signal.
    time : ndarray, shape (n,)
        [s], the first at zero.
    fitted : ndarray, shape (n,)
        The signal of the motion that was fitted, an acceleration without friction.
    friction : float
        Displacement ``r/k`` that was fitted, in natural units of the frequency that was fitted.
    prior : ForcePrior
        Of a random force.
    is_rounding : bool
        Whether the noise is mostly that of rounding.
    variance : ndarray, shape (n,)
        Of the noise of each relative to that of a whole block: infinite where all of it is missing.
    """

    def __init__(self, decay: PlainDecay) -> None:
        rounding = (quantisation_step(decay.values) or 0.0) / math.sqrt(12.0)
        self.is_rounding = 2.0 * rounding**2 > decay.noise_sd**2
        self.decay = decay = _on_even_grid(decay)
        block = decay.block
        whole = ~torn_blocks(decay.time, block)
        time = block_means(decay.time, block)[whole]
        unit = decay.frequency**decay.order
        states = np.column_stack([block_means(column, block)[whole] for column in decay.states.T]) / unit
        amplitude = float(np.max(np.hypot(*states.T)))
        self.friction = max(decay.coefficient / unit, 1e-6 * amplitude)
        n = max(_surely_sliding(states, self.friction, decay.frequency * decay.step * block), 0)
        self.fitted = unit * np.array([states[:n, 0], states[:n, 1], -states[:n, 0]][decay.order])
        measured = np.isfinite(decay.values)
        share = block_means(measured.astype(np.float64), block)[whole][:n]
        self.variance = variance_by_share(share)
        # of a block in part its samples' mean distance from the motion that was fitted
        motion = decay.states[:, 1] if decay.order == 1 else (1 - decay.order) * decay.states[:, 0]
        apart = np.where(measured, decay.values - decay.rest_position - motion, 0.0)
        apart = block_means(apart, block)[whole][:n]
        self.signal = self.fitted + np.divide(apart, share, out=apart, where=share > 0.0)
        self.time = (time - time[0])[:n]
        self.prior = ForcePrior(centre=_CENTRE * self.friction)
        self._states = states[:n]
        # of the sensor's rounding; a signal without noise is known no better than its interpolated motion
        self._least_noise = max(rounding, MOTION_KNOWN_TO * decay.amplitude) / math.sqrt(block)

    @property
    def missing(self) -> Mask:
        """Where no sample was recorded, and the signal is that of the motion that was fitted, shape (n,)."""
        return np.isinf(self.variance)

    @property
    def samples(self) -> int:
        """How many are not missing."""
        return int(np.count_nonzero(~self.missing))

    @property
    def noise_unit(self) -> float:
        """Noise of a sample, unit of the signal, where that of a mean of a block is one in natural units."""
        return self.decay.frequency**self.decay.order * math.sqrt(self.decay.block)

    def along_fit(self) -> Laid:
        """Regression along the trajectory that was fitted."""
        decay, n = self.decay, self.time.size
        covariance = np.zeros((n, 3, 3))
        covariance[:, 1, 1] = decay.phase_sd**2 * (self._states**2).sum(axis=1)
        motion = SmoothedMotion(
            states=np.column_stack([self._states, np.zeros(n)]),
            covariance=covariance,
            noise=decay.noise_sd / self.noise_unit,
            force_sd=0.0,
            tau=1.0,
        )
        return self.along(motion, decay.frequency)

    def along_smoothed(self) -> Laid:
        """Regression along the motion smoothed under a random force, in natural units of its frequency."""
        decay, frequency = self.decay, self.decay.frequency
        clock = Clock.of(frequency * self.time, self.variance)
        motion = first_motion(self.signal / frequency**decay.order, clock, sensor_row(decay.order))
        laid = self.along(motion, frequency)
        for _ in range(_MOST_ROUNDS):
            regression = laid.regression
            guessed = integrate_force(Problem.of(regression), self.prior, only_mode=True)
            law = guessed.best_law()
            change = frequency_change(law[regression.stiffness])
            frequency *= change
            motion = regression.smoothed(law, guessed.best).at_frequency(change)
            last, laid = laid.path, self.along(motion, frequency)
            if last.serves(laid.path.x, self.prior.centre):
                break
        return laid

    def along(self, motion: SmoothedMotion, frequency: float) -> Laid:
        """Regression along a motion in natural units of a frequency [rad/s]."""
        decay, unit = self.decay, frequency**self.decay.order
        x, v = motion.states[:, :2].T.copy()
        path = MeasuredPath.through(frequency * self.time, x, v, motion.velocity_sd, pendulum=decay.pendulum)
        variance = self.variance * _relative_variance(path, decay.order)
        regression = _regression(self.signal / unit, path, variance, motion, self.friction, decay)
        regression = replace(regression, least_noise=self._least_noise / unit)
        return Laid(prepared=self, path=path, regression=regression, frequency=frequency)


def _on_even_grid(decay: PlainDecay) -> PlainDecay:
    """The same with what :func:`places_on_grid` lacks: values are nan there, the motion as it was fitted."""
    index = places_on_grid(decay.time)
    if index[-1] + 1 == index.size:
        return decay
    time = np.interp(np.arange(index[-1] + 1), index, decay.time)
    values = np.full(time.size, np.nan)
    values[index] = decay.values
    states = np.empty((time.size, 2))
    states[index] = decay.states
    for k in np.flatnonzero(np.diff(index) > 1).tolist():
        inside = slice(index[k], index[k + 1] + 1)
        states[inside] = _across_gap(decay, decay.frequency * time[inside], decay.states[k : k + 2])
    return replace(decay, time=time, values=values, states=states)


def _across_gap(decay: PlainDecay, phase: Array, ends: Array) -> Array:
    """Dry friction's motion from the first of two states, shape (2, 2), to the second, shape (n, 2).

    By how much it misses the second, as on a pendulum that swings slower, it has missed in proportion before.
    """
    motion = coulomb_decay(
        _NATURAL, abs(decay.coefficient), float(ends[0, 0]), float(ends[0, 1]), phase - phase[0]
    )
    states = np.column_stack([motion.displacement, motion.velocity])
    share, left = (phase - phase[0]) / (phase[-1] - phase[0]), phase[-1] - phase
    x, v = ends[1] - states[-1]
    missed = np.column_stack([x * np.cos(left) - v * np.sin(left), x * np.sin(left) + v * np.cos(left)])
    return np.asarray(states + share[:, None] * missed)


def _surely_sliding(states: Array, friction: float, step: float) -> int:
    """Number of samples before the half cycles that may end in sticking.

    The amplitude falls by ``2 r/k`` a half cycle.
    """
    n = len(states)
    last = states[-max(round(math.pi / step), 1) :]
    left = float(np.mean(np.hypot(last[:, 0], last[:, 1])))
    half_cycles = min(max((_SURELY_SLIDES * friction - left) / (2.0 * friction), 0.0), _SURELY_SLIDES)
    return n - math.ceil(half_cycles * math.pi / step)


def _relative_variance(path: MeasuredPath, order: int) -> Array:
    """Relative variances: one where a sample counts, which no acceleration near a turning point does."""
    near = np.abs(path.v) < NEAR_TURN * np.hypot(path.x, path.v)
    return np.where(near & (order == 2), np.inf, 1.0)


def _regression(
    signal: Array,
    path: MeasuredPath,
    variance: Array,
    motion: SmoothedMotion,
    friction: float,
    decay: PlainDecay,
) -> LawRegression:
    row = sensor_row(decay.order, path.slope)

    def forces(x: Array, direction: Array, stiffness: Array) -> Array:
        """Columns of friction, of stiffness, and of the restoring force less ``stiffness x``."""
        restoring = path.restoring(x)
        return np.stack([-direction, -restoring, stiffness * x - restoring], axis=1)

    at_nodes = forces(path.node_x, path.direction, path.stiffness[path.interval])
    at_samples = forces(path.x, path.expected_direction, path.slope)
    states, answered = response_at_sensor(path, row, at_nodes, at_samples)
    start = initial_response(path.phase, path.stiffness)
    columns = np.column_stack([at_sensor(start, row), answered[:, :2]])
    known = states[:, :, 2]
    states = np.concatenate([start, states[:, :, :2]], axis=2)
    names = _OF_MOTION
    amplitude = float(np.max(np.hypot(path.x, path.v)))
    scale = np.array([10.0 * amplitude, 10.0 * amplitude, 2.0 * friction, 0.05])
    if not decay.rest_known:
        columns = np.column_stack([columns, np.ones(signal.size)])
        states = np.concatenate([states, np.zeros((signal.size, 2, 1))], axis=2)
        names, scale = (*names, "rest"), np.append(scale, 0.1 * amplitude)
    size = len(names)
    return LawRegression(
        clock=Clock.of(path.phase, variance, stiffness=path.stiffness),
        row=row,
        names=names,
        columns=columns,
        states=states,
        known_states=known,
        target=signal - answered[:, 2],
        scale=scale,
        positive=np.zeros(size, np.bool_),
        sets=np.ones((1, size), np.bool_),
        log_prior=np.zeros(1),
        stiffness=names.index("stiffness"),
        motion=motion,
    )
