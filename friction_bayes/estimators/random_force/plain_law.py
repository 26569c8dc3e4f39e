r"""The plain law under a random force: start, friction, stiffness, rest position, along the measured motion.

In natural units, about the rest position,

.. math:: x'' = -x - c\,\mathrm{sign}\,v - \kappa x + d

or, for a pendulum, ``x'' = -sin x - c sign v - kappa sin x + d``, with the reference frequency taken from
the fit without a random force: ``kappa`` corrects it. The forces are evaluated along the smoothed motion, so
that the signal is linear in start, ``c``, ``kappa`` and rest position, and the average over the random force
is that of :mod:`friction_bayes.estimators.random_force.posterior`.

Priors, of the scale of this record: friction ``F`` as fitted without a random force and amplitude ``A``;
``c`` normal with sd 2 F about zero, ``kappa`` 0.05, rest position 0.1 A, start 10 A; the random force as in
:class:`friction_bayes.estimators.random_force.posterior.ForcePrior` about 0.3 F.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import stats

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.core.arrays import Array
from friction_bayes.decay.block_means import block_means, samples_in_block, torn_blocks
from friction_bayes.decay.whiteness import Whiteness, whiteness
from friction_bayes.estimators.random_force.law_regression import LawRegression, frequency_change
from friction_bayes.estimators.random_force.measured_path import NEAR_TURN, MeasuredPath
from friction_bayes.estimators.random_force.posterior import ForcePrior, Posterior, integrate
from friction_bayes.estimators.random_force.response import at_sensor, force_response
from friction_bayes.estimators.random_force.sampler_target import force_target, half_cycle_blocks
from friction_bayes.estimators.random_force.smoothing import LEAST_NOISE, Motion, first_motion
from friction_bayes.estimators.random_force.subsets import all_sets
from friction_bayes.estimators.random_force.transition import initial_response
from friction_bayes.estimators.random_force.whitening import Clock, sensor_row
from friction_bayes.records.quantisation import quantisation_step

__all__ = ["PlainDecay", "PlainPosterior", "plain_posterior"]

_CENTRE = 0.3
"""Median of the random force's sd over the friction that explains the loss of amplitude."""
_SURELY_SLIDES = 3.0
"""Amplitude over ``r/k`` below which a half cycle may end in sticking, and is left out."""
_LEAST_SAMPLES = 64
_SLIGHT = 0.05
"""Share of friction below which a random force may be what the turning points of its path are off by."""
_MOST_ROUNDS = 4
"""Motions that are smoothed with a law: one serves but for a pendulum that swings far."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlainDecay:
    """One decay and what the fit without a random force has found in it.

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
    rest_known : bool
        Whether that was given.
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
    rest_known: bool = False
    pendulum: bool = False
    noise_sd: float

    @property
    def step(self) -> float:
        """Mean sampling interval [s]."""
        return float(self.time[-1] / (self.time.size - 1))

    @property
    def block(self) -> int:
        """How many samples are averaged into one; those of an accelerometer, which jumps, are not."""
        per_period = 2.0 * math.pi / (self.frequency * self.step)
        return 1 if self.order == 2 else samples_in_block(per_period)

    @property
    def amplitude(self) -> float:
        """Largest of the signal about its rest position."""
        return float(np.max(np.abs(self.values - self.rest_position)))

    @property
    def usable(self) -> bool:
        """Whether a random force can be told from anything here."""
        return (
            # an oscillation that grows is no free decay
            self.coefficient > 0.0
            and self.values.size // self.block >= _LEAST_SAMPLES
            and self.frequency * self.step < 0.5 * math.pi
            and self.noise_sd > LEAST_NOISE * self.amplitude
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class PlainPosterior:
    """What the regression says, in units of the signal.

    Attributes
    ----------
    probability : float
        That there is a random force.
    coefficient : Mixture
        Friction coefficient ``u`` of the signal, given that there is.
    sd : frozen scipy.stats distribution
        Standard deviation of the random force in the unit of ``coefficient``, given that there is one.
    correlation_time : frozen scipy.stats distribution
        Of the random force [s], given that there is one.
    frequency, frequency_sd : float
        Given that there is one [rad/s].
    noise_sd : float
        Of a sample, given that there is one.
    innovations : Whiteness
        Of the whitened residuals at the most probable random force.
    target : callable, float -> Target
        The same posterior given that there is a random force, for a sampler; from the factor from
        ``coefficient`` to force.
    """

    probability: float
    coefficient: Mixture
    sd: stats.distributions.rv_frozen
    correlation_time: stats.distributions.rv_frozen
    frequency: float
    frequency_sd: float
    noise_sd: float
    innovations: Whiteness
    target: Callable[[float], Target] = field(repr=False)


def plain_posterior(decay: PlainDecay) -> PlainPosterior | None:
    """Average over the random force; None where nothing can be said of one."""
    if not decay.usable:
        return None
    frequency, block = decay.frequency, decay.block
    whole = ~torn_blocks(decay.time, block)
    averaged = block_means(decay.values - decay.rest_position, block)[whole]
    step = decay.step * block
    phase = block_means(decay.time, block)[whole]
    phase = phase - phase[0]
    motion = first_motion(
        averaged / frequency**decay.order, Clock.of(frequency * phase), sensor_row(decay.order)
    )
    amplitude = float(np.max(np.hypot(motion.states[:, 0], motion.states[:, 1])))
    friction = max(decay.coefficient / frequency**decay.order, 1e-6 * amplitude)
    n = _surely_sliding(motion, friction, frequency * step)
    if n < _LEAST_SAMPLES:
        return None
    prior = ForcePrior(centre=_CENTRE * friction)
    # of the sensor's rounding; a signal without noise is known no better than its interpolated motion
    rounding = (quantisation_step(decay.values) or 0.0) / math.sqrt(12.0)
    least_noise = max(rounding, LEAST_NOISE * decay.amplitude) / math.sqrt(block)

    def along(
        motion: Motion, frequency: float, variance: Array | None = None
    ) -> tuple[MeasuredPath, LawRegression]:
        unit = frequency**decay.order
        x, v = motion.states[:n, :2].T.copy()
        path = MeasuredPath.through(
            frequency * phase[:n], x, v, motion.velocity_sd[:n], pendulum=decay.pendulum
        )
        if variance is None:
            variance = _relative_variance(path, decay.order)
        regression = _regression(averaged[:n] / unit, path, variance, motion, friction, decay)
        return path, replace(regression, least_noise=least_noise / unit)

    path, regression = along(motion, frequency)
    for _ in range(_MOST_ROUNDS):
        guessed = integrate(regression.problem, prior, regression.motion.noise, only_mode=True)
        law = guessed.best_law()
        change = frequency_change(law[regression.stiffness])
        frequency *= change
        motion = regression.smoothed(law, guessed.best).at_frequency(change)
        last, (path, regression) = path, along(motion, frequency)
        if last.serves(path.x, prior.centre):
            break
    posterior = integrate(regression.problem, prior, regression.motion.noise)
    for _ in range(_MOST_ROUNDS):
        if not 0.0 < _mean_force(posterior) < _SLIGHT * friction:
            break
        still = posterior.among((posterior.ratio == 0.0)[:, None])
        law = still.best_law()
        change = frequency_change(law[regression.stiffness])
        alone = regression.smoothed(law, still.best).at_frequency(change)
        # evidences compare where they are of the same samples
        _, other = along(alone, frequency * change, regression.clock.variance)
        beside = integrate(other.problem, prior, other.motion.noise)
        if beside.log_evidence <= posterior.log_evidence:
            break
        frequency, regression, posterior = frequency * change, other, beside
    signal = averaged[:n] + decay.rest_position
    return _in_units_of_the_signal(posterior, regression, prior, decay, frequency, signal)


def _mean_force(posterior: Posterior) -> float:
    """Sd of the random force over all that is probable, natural units."""
    return posterior.probability * float(posterior.force_sd.mean()) if posterior.probability > 0.0 else 0.0


def _surely_sliding(motion: Motion, friction: float, step: float) -> int:
    """How many samples come before the half cycles that may end in sticking.

    The amplitude falls by ``2 r/k`` a half cycle.
    """
    n = len(motion.states)
    last = motion.states[-max(round(math.pi / step), 1) :, :2]
    left = float(np.mean(np.hypot(last[:, 0], last[:, 1])))
    half_cycles = min(max((_SURELY_SLIDES * friction - left) / (2.0 * friction), 0.0), _SURELY_SLIDES)
    return n - math.ceil(half_cycles * math.pi / step)


def _relative_variance(path: MeasuredPath, order: int) -> Array:
    """One of every sample that counts: no acceleration near a turning point does."""
    near = np.abs(path.v) < NEAR_TURN * np.hypot(path.x, path.v)
    return np.where(near & (order == 2), np.inf, 1.0)


def _regression(
    signal: Array, path: MeasuredPath, variance: Array, motion: Motion, friction: float, decay: PlainDecay
) -> LawRegression:
    row = sensor_row(decay.order, path.slope)

    def forces(x: Array, direction: Array, stiffness: Array) -> Array:
        """Friction, stiffness and what the restoring force lacks of ``stiffness x``, in columns."""
        restoring = path.restoring(x)
        return np.stack([-direction, -restoring, stiffness * x - restoring], axis=1)

    states = force_response(path, forces(path.node_x, path.direction, path.stiffness[path.interval]))
    answered = at_sensor(states, row, forces(path.x, path.expected_direction, path.slope))
    start = initial_response(path.phase, path.stiffness)
    columns = np.column_stack([at_sensor(start, row), answered[:, :2]])
    known = states[:, :, 2]
    states = np.concatenate([start, states[:, :, :2]], axis=2)
    names: tuple[str, ...] = ("displacement", "velocity", "friction", "stiffness")
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
        sets=all_sets(np.ones(size, np.bool_)),
        log_prior=np.zeros(1),
        stiffness=names.index("stiffness"),
        motion=motion,
    )


def _in_units_of_the_signal(
    posterior: Posterior,
    regression: LawRegression,
    prior: ForcePrior,
    decay: PlainDecay,
    frequency: float,
    signal: Array,
) -> PlainPosterior:
    kappa = posterior.coefficient("stiffness", given_force=True)
    found = frequency * frequency_change(kappa.mean())
    # c is r / m over the reference frequency squared, u is w0**q r/k at the frequency found
    unit = frequency**2 * found ** (decay.order - 2)
    # of a sample, where the regression has means of blocks
    noise_unit = frequency**decay.order * math.sqrt(decay.block)
    with_force = [point for point in posterior.points if point.ratio > 0.0]
    share = np.array([weight.sum() for weight in posterior.weight[posterior.ratio > 0.0]])
    noise = float(share @ [point.noise for point in with_force] / share.sum())
    best = posterior.best
    innovations = regression.innovations(posterior.best_law(), best.ratio, best.tau)
    sd, tau = posterior.force_sd, posterior.correlation_time

    def target(force_factor: float) -> Target:
        friction = regression.names.index("friction")

        def natural(law: Array, noise: Array, q: Array, tau: Array) -> dict[str, Array]:
            change = [frequency_change(kappa) for kappa in law[:, regression.stiffness]]
            return {
                "friction": force_factor * unit * law[:, friction],
                "frequency": frequency * np.array(change),
                "precision": (noise_unit * noise) ** -2.0,
                "random_force_sd": force_factor * unit * q,
                "correlation_time": tau / frequency,
            }

        return force_target(
            regression,
            prior,
            natural=natural,
            blocks=half_cycle_blocks(regression.clock.phase),
            signal=signal,
            unit=frequency**decay.order,
        )

    return PlainPosterior(
        probability=posterior.probability,
        coefficient=posterior.coefficient("friction", given_force=True).scaled(unit),
        sd=stats.lognorm(*sd.args, scale=sd.kwds["scale"] * unit),
        correlation_time=stats.lognorm(*tau.args, scale=tau.kwds["scale"] / frequency),
        frequency=found,
        frequency_sd=0.5 * frequency**2 / found * kappa.std(),
        noise_sd=noise * noise_unit,
        innovations=whiteness(innovations[np.isfinite(regression.clock.variance)]),
        target=target,
    )
