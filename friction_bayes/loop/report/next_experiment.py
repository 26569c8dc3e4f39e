"""What to measure next: where candidates tie, or where none explains the record.

Which further record would decide between candidates that tie is computed from the candidates themselves.
Each experiment is predicted under the most probable candidate. A rival, with its posterior from the records
so far and an initial state of its own, can follow that prediction in part; what is left is linear algebra:
with the difference ``D`` of the two predictions, noise ``V`` and the rival's derivatives ``J`` and covariance
``C``, the expected log Bayes factor is ``D' (V + J C J')^-1 D / 2``. Noise is that of the sensor and, under a
rival with a random force, the response of the motion to that force. Where the two candidates differ in their
random force the records also differ in their scatter, which adds to it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.special import logit

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.text import listed
from friction_bayes.loop import settings
from friction_bayes.loop.data.model import LoopModel, Prediction
from friction_bayes.loop.data.parameters import (
    DISPLACEMENT,
    FRICTION,
    LOG_FREQUENCY_RATIO,
    SHARED,
    VELOCITY,
)
from friction_bayes.loop.infer.law_draws import DrawnLaws
from friction_bayes.mechanics.effects import in_catalogue_order
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.statespace import kalman
from friction_bayes.statespace.kalman import Clock, sensor_row
from friction_bayes.statespace.regression import frequency_change

__all__ = [
    "WHETHER_IT_RUBS",
    "Contender",
    "drawn_contender",
    "expected_log_bayes_factor",
    "experiment_on_unexplained",
    "log_bayes_factor_of_scatter",
    "next_experiment",
    "proposals",
    "rival_prediction",
]

WHETHER_IT_RUBS = (
    "Record the decay until it stops, or release it once more from a third of the amplitude and close the "
    "loop on both records: dry friction ends a motion, a loss that grows with the speed lets it die out."
)
"""Where one set of effects is known, and not whether dry friction acts with it."""
_STEP = 1e-3
_STATE_STEP = 1e-4
"""Difference step in the initial state, in amplitudes."""
_RECORDS = 100
"""Simulated records over which the scatter of two candidates is compared."""
_BY_VARIABLE = {
    "velocity": "Release it from half and from twice the amplitude, and close the loop on all records "
    "together: a force that belongs to the velocity comes again at the same velocity, and its curve in the "
    "figure of the force left over is the effect to register.",
    "position": "Move the sensor against the machine, release again and compare the force left over: what "
    "stays at its place in the machine is a force (a guide, a cable), what moves along is an error of the "
    "sensor.",
    "amplitude": "Release it from half the amplitude, and close the loop on both records together: a force "
    "that belongs to the amplitude comes again at the same amplitude, one that belongs to the time does not.",
    "time": "Release it again at once without touching it: what follows the time since the release comes "
    "again, what went on in the meantime is warming or wear.",
}
_OF_THE_SENSOR = {"whiteness", "spectrum", "tails"}
"""Tests of the scatter of samples, independent of the motion."""
_OF_RECORDS = (
    "Close the loop on each record by itself, and look for what was not the same between them: mounting, "
    "temperature, wear, the side of the release. Where friction is known to differ, fit it as varying "
    "(--varying-friction, varying_friction=True): its mean and its spread are then found."
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Contender:
    """A candidate with all that is needed to predict a further record.

    Attributes
    ----------
    model : LoopModel
    z : ndarray, shape (p,)
        Its coordinates.
    covariance : ndarray, shape (p, p)
        Of these, from the records so far.
    noise_sd : float
        Sd of the sensor's noise, taken as white, unit of the signal.
    random_force : float
        Sd of the random force [N or N m]; zero for none.
    correlation_time : float
        Of that force [s].
    """

    model: LoopModel
    z: Array
    covariance: Array
    noise_sd: float
    random_force: float = 0.0
    correlation_time: float = 0.0

    @property
    def friction(self) -> float:
        """Friction force [N or N m]."""
        return float(self.model.value(self.z, FRICTION))

    @property
    def frequency(self) -> float:
        """Natural frequency [rad/s]."""
        ratio = math.exp(float(self.model.value(self.z, LOG_FREQUENCY_RATIO)))
        return self.model.system.natural_frequency * ratio

    def force_over_noise(self, noise: float) -> tuple[float, float]:
        """Random force over a noise in natural units, and its correlation time as a phase."""
        frequency = self.frequency
        _, stiffness = self.model.mass_and_stiffness(frequency / self.model.system.natural_frequency)
        return self.random_force / (stiffness * noise), max(self.correlation_time * frequency, 1e-6)


@dataclass(frozen=True, eq=False)
class Proposal:
    """A further record: where it is released from rest, when it is sampled, and which derivative.

    The expected log Bayes factor is of the most probable candidate against the rival.
    """

    what: str
    largest: float
    time: Array
    order: int
    log_bayes_factor: float = 0.0


def next_experiment(candidates: Sequence[Contender], names: Sequence[str]) -> str | None:
    """The further record that separates the first candidate best from its rivals, in a sentence."""
    decided = [proposals(candidates[0], rival) for rival in candidates[1:]]
    if not decided or not decided[0]:
        return None
    # a record is scored by the rival that it separates worst
    scores = [min(options[i].log_bayes_factor for options in decided) for i in range(len(decided[0]))]
    best = int(np.argmax(scores))
    rivals = listed(names[1:], "or")
    chosen, score = decided[0][best], scores[best]
    if score < logit(settings.SETTINGS.credible_mass):
        text = f"No single further record is expected to separate {names[0]} from {rivals}"
        if (factor := f"{math.exp(score):.2g}") != "1":
            text += f"; the best, {chosen.what}, is expected to shift the odds by a factor {factor}"
        return f"{text}{_difference_in_friction(candidates)}."
    factor = f"{math.exp(score):.2g}" if score < 12.0 else "more than 1e5"
    return (
        f"Add {chosen.what}: it is expected to separate {names[0]} from {rivals} by a Bayes factor of "
        f"{factor}{_difference_in_friction(candidates)}."
    )


def _difference_in_friction(candidates: Sequence[Contender]) -> str:
    """How far friction depends on which candidate is right."""
    frictions = [candidate.friction for candidate in candidates]
    spread = (max(frictions) - min(frictions)) / max(max(frictions), 1e-300)
    percent = f"{100.0 * spread:.2g}" if spread >= 1e-4 else "less than 0.01"
    return f"; friction differs between them by {percent} %"


def proposals(truth: Contender, rival: Contender) -> list[Proposal]:
    """Scores of the experiments on a pair of candidates."""
    segment, turns = truth.model.segments[0], truth.model.system.angular
    order, amplitude = segment.order, truth.model.scales.amplitude
    samples = np.arange(2 * segment.values.size)
    twice: Array = np.asarray(segment.decay.step * samples, dtype=np.float64)
    once = twice[: segment.values.size]
    if order == 2:
        other = Proposal(f"a record of the {'angle' if turns else 'displacement'}", amplitude, once, 0)
    else:
        measured = "angular acceleration" if turns else "acceleration"
        other = Proposal(f"a record of the {measured}", amplitude, once, 2)
    options = [
        Proposal("a record released from half the amplitude", 0.5 * amplitude, once, order),
        Proposal("a record released from twice the amplitude", 2.0 * amplitude, once, order),
        Proposal("a record twice as long", amplitude, twice, order),
        other,
    ]
    return [replace(option, log_bayes_factor=_score(truth, rival, option)) for option in options]


def _score(truth: Contender, rival: Contender, option: Proposal) -> float:
    """Expected log Bayes factor of a proposed record; zero where a motion does not stay finite."""
    time = option.time
    target = truth.model.predict_at(truth.z, 0, time, (option.largest, 0.0), option.order)
    predicted = rival_prediction(rival, option)
    if target is None or predicted is None:
        return 0.0
    base, jacobian, covariance = predicted
    difference = target.signal - base.signal
    # the other sensor is taken to have the same noise relative to the signal
    ratio = truth.model.system.natural_frequency ** (option.order - truth.model.segments[0].order)
    sd = truth.noise_sd * ratio
    if not truth.random_force and not rival.random_force:
        return expected_log_bayes_factor(difference / sd, jacobian / sd, covariance)
    # a random force counts during the motion alone: a contact at rest has another law
    half_cycle = math.pi / truth.frequency
    moving = int(np.searchsorted(time, min(target.stop_time, base.stop_time) - half_cycle))
    if moving < 2:
        return 0.0
    time, difference, jacobian = time[:moving], difference[:moving], jacobian[:moving]
    clock, row = Clock.of(truth.frequency * time), sensor_row(option.order)
    forces = [c.force_over_noise(sd / truth.frequency**option.order) for c in (truth, rival)]
    block = np.column_stack([difference, jacobian]) / sd
    whitened = kalman.whiten(block, clock, row, *forces[1], keep=True).columns
    assert whitened is not None
    scatter = log_bayes_factor_of_scatter(jacobian / sd, covariance, clock, row, *forces)
    return expected_log_bayes_factor(whitened[:, 0], whitened[:, 1:], covariance) + scatter


def rival_prediction(rival: Contender, option: Proposal) -> tuple[Prediction, Array, Array] | None:
    """Prediction of a proposed record by a rival; None where its motion is not finite.

    With the derivatives of its signal in the rival's law and in the initial displacement and velocity, both
    in amplitudes, shape (n, q), and the covariance of these before the record, (q, q).
    """
    model, time, largest = rival.model, option.time, option.largest
    fast = largest * model.system.natural_frequency
    base = model.predict_at(rival.z, 0, time, (largest, 0.0), option.order)
    if base is None:
        return None

    def change(z: Array, state: tuple[float, float], step: float) -> Array:
        """Derivative of the rival's prediction."""
        moved = model.predict_at(z, 0, time, state, option.order)
        return np.zeros(time.size) if moved is None else (moved.signal - base.signal) / step

    posterior = rival.covariance
    law = [
        j
        for j, c in enumerate(model.coordinates)
        if (c.effect or c.record == SHARED) and posterior[j, j] > 0.0
    ]
    columns = []
    for j in law:
        step = min(_STEP, 0.1 * math.sqrt(posterior[j, j]))
        moved = rival.z.copy()
        moved[j] += step
        columns.append(change(moved, (largest, 0.0), step))
    columns.append(change(rival.z, (largest + _STATE_STEP * largest, 0.0), _STATE_STEP))
    columns.append(change(rival.z, (largest, _STATE_STEP * fast), _STATE_STEP))
    covariance = block_diag(posterior[np.ix_(law, law)], settings.SETTINGS.state_share**2 * np.eye(2))
    return base, np.column_stack(columns), covariance


def expected_log_bayes_factor(difference: Array, jacobian: Array, covariance: Array) -> float:
    r"""Expected log Bayes factor of two linear models of a record, white noise of unit variance.

    .. math:: \tfrac12 D^T (I + J C J^T)^{-1} D,

    by Woodbury's identity. It is the expectation under the first model where both are uncertain by the same
    :math:`J C J^T`, as two models of one past record are.

    The :math:`D` of n samples is the prediction of the first model minus that of the second, :math:`J` its
    derivatives in its q parameters and :math:`C` the covariance of these before the record.
    """
    shared = jacobian.T @ difference
    inner = np.eye(len(covariance)) + jacobian.T @ jacobian @ covariance
    absorbed = float(shared @ covariance @ np.linalg.solve(inner, shared))
    return max(0.5 * (float(difference @ difference) - absorbed), 0.0)


def log_bayes_factor_of_scatter(
    jacobian: Array,
    covariance: Array,
    clock: Clock,
    row: Array,
    truth: tuple[float, float],
    rival: tuple[float, float],
) -> float:
    r"""Expected log Bayes factor of two random forces with the same law, noise of unit variance.

    With :math:`V_1, V_2` the covariances of the record under the two, the uncertainty
    :math:`J C J^T` of the law included, it is

    .. math:: \tfrac12 E\left[y^T (V_2^{-1} - V_1^{-1}) y\right] + \tfrac12 \log |V_2| / |V_1|,

    averaged over simulated :math:`y \sim N(0, V_1)`, always the same ones.

    A force is its sd over the noise and correlation time as a phase; ``row``, shape (3,), is of the sensor.
    """
    if truth == rival:
        return 0.0
    rng = np.random.default_rng(0)
    root = np.linalg.cholesky(covariance + 1e-12 * np.diag(np.diag(covariance)))
    records = kalman.colour(rng.standard_normal((clock.phase.size, _RECORDS)), clock, row, *truth)
    records += jacobian @ (root @ rng.standard_normal((len(covariance), _RECORDS)))
    block, q = np.column_stack([jacobian, records]), len(covariance)

    def log_density(force: tuple[float, float]) -> float:
        """Mean log density of the records, without what all forces share."""
        whitened = kalman.whiten(block, clock, row, *force)
        shared = whitened.gram[:q, q:]
        inner = np.eye(q) + whitened.gram[:q, :q] @ covariance
        absorbed = np.sum(shared * (covariance @ np.linalg.solve(inner, shared)), axis=0)
        squares = float(np.mean(np.diag(whitened.gram)[q:] - absorbed))
        return -0.5 * (squares + whitened.log_determinant + float(np.linalg.slogdet(inner)[1]))

    return max(log_density(truth) - log_density(rival), 0.0)


def drawn_contender(laws: DrawnLaws, chosen: Mask) -> Contender | None:
    """The candidate of some draws, ``chosen`` of shape (k,); None where they are too few.

    Its law is their mean, in the most frequent shape of each effect; state and sensor are those of the first
    record. Where friction differs between the records it would in a further one too.
    """
    draws, fit = laws.first, laws.first.fit
    if np.count_nonzero(chosen) < 2:
        return None
    shape = int(np.argmax(np.bincount(draws.set_index[chosen])))
    mine = chosen & (draws.set_index == shape)
    if np.count_nonzero(mine) < 2:
        return None
    names = fit.sets[shape]
    model = LoopModel(fit.record.system, (fit.segment,), in_catalogue_order(names))
    declared = fit.w0 / fit.record.system.natural_frequency
    change = np.array([frequency_change(kappa) for kappa in draws.stiffness[mine]])
    values = {
        ("", FRICTION): laws.friction[mine],
        ("", LOG_FREQUENCY_RATIO): np.log(declared * change),
        ("", DISPLACEMENT): draws.coefficients[mine, 0],
        ("", VELOCITY): draws.coefficients[mine, 1] * fit.w0,
    } | {
        (name, parameter): drawn
        for name in names
        for parameter, drawn in _of_model(name, draws.parameters(name, mine)).items()
    }
    z = model.coordinates_of(values, int(np.count_nonzero(mine)))
    covariance, rubs = np.cov(z, rowvar=False), model.index(FRICTION)
    covariance[rubs, rubs] += np.mean((laws.spread[mine] / model.coordinates[rubs].prior.scale) ** 2)
    return Contender(
        model=model,
        z=z.mean(axis=0),
        covariance=covariance,
        noise_sd=fit.noise_sd,
        random_force=float(np.median(draws.random_force[mine])),
        correlation_time=float(np.median(draws.correlation_time[mine])),
    )


def _of_model(name: str, drawn: dict[str, Array]) -> dict[str, Array]:
    """Parameters as in the simulated model: a line of interference by amplitude and phase."""
    if name != PERIODIC_INTERFERENCE.name:
        return drawn
    sine, cosine = float(drawn["sine"].mean()), float(drawn["cosine"].mean())
    return {
        "frequency": np.full_like(drawn["sine"], drawn["frequency"].mean()),
        "amplitude": np.full_like(drawn["sine"], math.hypot(sine, cosine)),
        "phase": np.full_like(drawn["sine"], math.atan2(cosine, sine)),
    }


def experiment_on_unexplained(
    depends_on: str | None, failed: Collection[str], because: Collection[str], records: int
) -> str:
    """A sentence on the measurement that shows where the residual of one or several records comes from.

    By the variable that the force left over depends on, the tests that failed, and what forbids to use the
    number.
    """
    if "records" in because:
        return _OF_RECORDS
    if depends_on is not None:
        return _BY_VARIABLE[depends_on]
    if failed and _OF_THE_SENSOR.issuperset(failed):
        return (
            "Record the machine at rest with the same sensor: what scatters the same way there is the "
            "sensor's, what does not comes with the motion."
        )
    if records > 1:
        return (
            "Nothing yet: close the loop on each record by itself first. A knock or a sensor that slipped in "
            "one of them is reported there, and so is friction, which all were taken to share."
        )
    return (
        "Repeat the release twice from the same amplitude, and close the loop on all records together: what "
        "comes again is an effect to look for in the figures of the residual, what does not is a disturbance."
    )
