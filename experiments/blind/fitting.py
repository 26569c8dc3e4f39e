"""Fit any set of catalogue effects to a noise-free signal by least squares: how near can a rival come?

The optimum is sought with more freedom than a judge would need: natural frequency, initial state and
friction float, several starts are tried, and the lowest chi-square counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from experiments.blind.forward import PARAMETERS, decay_signal

__all__ = ["Problem", "fit_set", "physical_parameters"]

Vector = NDArray[np.float64]

ALL_PARAMETERS = (*PARAMETERS, "offset", "rate", "sine", "cosine", "line_frequency")
_INDEX = {name: i for i, name in enumerate(ALL_PARAMETERS)}
_N_MOTION = len(PARAMETERS)
_ALWAYS = tuple(range(4))

_FREED = {
    "viscous_damping": ("damping_ratio",),
    "quadratic_drag": ("drag",),
    "asymmetric_friction": ("asymmetry",),
    "stribeck_friction": ("static_excess", "log_stribeck_velocity"),
    "friction_drift": ("relative_change",),
    "cubic_stiffness": ("cubic",),
    "sensor_offset": ("offset",),
    "sensor_drift": ("offset", "rate"),
    "periodic_interference": ("sine", "cosine", "line_frequency"),
}

_LOW = np.full(len(ALL_PARAMETERS), -np.inf)
_HIGH = np.full(len(ALL_PARAMETERS), np.inf)
for _name, _low, _high in (
    ("frequency", 0.5, 2.0),
    ("friction", 0.0, 0.5),
    ("damping_ratio", 0.0, 0.5),
    ("drag", 0.0, 2.0),
    ("asymmetry", -1.0, 1.0),
    ("static_excess", 0.0, 20.0),
    ("log_stribeck_velocity", math.log(0.005), math.log(3.0)),
    ("relative_change", -2.0, 2.0),
    ("cubic", -0.6, 3.0),
):
    _LOW[_INDEX[_name]], _HIGH[_INDEX[_name]] = _low, _high

# a line that does not come round within the record is a drift, not a line
_SHORTEST_LINE = 2.0 * math.pi

_DIFFERENCE = np.full(_N_MOTION, 1e-6)
_DIFFERENCE[[_INDEX["asymmetry"], _INDEX["static_excess"], _INDEX["relative_change"]]] = 1e-4
_DIFFERENCE[_INDEX["log_stribeck_velocity"]] = 1e-3

_ITERATIONS = 40
# over two successive steps; all that is needed is whether a loss exceeds 10 or 200
_CONVERGED = 0.02
_CONVERGED_RELATIVE = 2e-3


@dataclass(frozen=True)
class Problem:
    """A noise-free signal to be imitated.

    Attributes
    ----------
    times, signal : ndarray, shape (n,)
        Dimensionless.
    used : ndarray of bool, shape (n,)
        Samples that count; flat ones of a clipped signal do not where clipping is part of the rival.
    noise_sd : float
        Of one sample.
    weight : float
        Samples of the record that each one here represents.
    end : float
        Duration over which friction drifts.
    order : int
        Derivative order of the signal.
    rest_time : float
        When the true motion ends.
    """

    times: Vector
    signal: Vector
    used: NDArray[np.bool_]
    noise_sd: float
    weight: float
    end: float
    order: int
    rest_time: float = math.inf

    def residual(self, p: Vector) -> Vector:
        """Weighted difference; its sum of squares is the chi-square loss."""
        return math.sqrt(self.weight) / self.noise_sd * np.where(self.used, self.signal - self.model(p), 0.0)

    def model(self, p: Vector) -> Vector:
        """Signal of a full parameter vector (see ``ALL_PARAMETERS``)."""
        out = decay_signal(p[:_N_MOTION], self.times, self.end, self.order)
        offset, rate, sine, cosine, line = p[_N_MOTION:]
        if offset or rate:
            out += offset + rate * self.times / self.end
        if sine or cosine:
            out += sine * np.sin(line * self.times) + cosine * np.cos(line * self.times)
        return out

    def jacobian(self, p: Vector, free: Vector, residual: Vector) -> Vector:
        """Derivatives of :meth:`residual`, motion by forward differences, sensor terms exactly."""
        scale = math.sqrt(self.weight) / self.noise_sd * self.used
        columns = np.empty((self.times.size, free.size))
        for j, i in enumerate(free):
            if i < _N_MOTION:
                step = _DIFFERENCE[i] if p[i] + _DIFFERENCE[i] <= _HIGH[i] else -_DIFFERENCE[i]
                moved = p.copy()
                moved[i] += step
                columns[:, j] = (self.residual(moved) - residual) / step
            else:
                columns[:, j] = -scale * self._sensor_column(p, int(i))
        return columns

    def _sensor_column(self, p: Vector, i: int) -> Vector:
        line = p[_INDEX["line_frequency"]]
        if i == _INDEX["offset"]:
            return np.ones(self.times.size)
        if i == _INDEX["rate"]:
            return self.times / self.end
        if i == _INDEX["sine"]:
            return np.sin(line * self.times)
        if i == _INDEX["cosine"]:
            return np.cos(line * self.times)
        sine, cosine = p[_INDEX["sine"]], p[_INDEX["cosine"]]
        return self.times * (sine * np.cos(line * self.times) - cosine * np.sin(line * self.times))


def physical_parameters(**known: float) -> Vector:
    """Full parameter vector with the given values and every other effect absent."""
    p = np.zeros(len(ALL_PARAMETERS))
    p[_INDEX["frequency"]] = 1.0
    p[_INDEX["log_stribeck_velocity"]] = math.log(0.2)
    for name, value in known.items():
        p[_INDEX[name]] = value
    return p


def _minimise(problem: Problem, p: Vector, free: Vector) -> tuple[float, Vector]:
    """Levenberg-Marquardt, projected on the bounds: a parameter pushed against its bound is fixed."""
    low, high = _LOW.copy(), _HIGH
    low[_INDEX["line_frequency"]] = _SHORTEST_LINE / problem.times[-1]
    p = np.clip(p, low, high)
    residual = problem.residual(p)
    loss = float(residual @ residual)
    damping, slow = 1e-3, 0
    for _ in range(_ITERATIONS):
        jacobian = problem.jacobian(p, free, residual)
        gradient = jacobian.T @ residual
        outward = ((p[free] <= low[free]) & (gradient > 0.0)) | ((p[free] >= high[free]) & (gradient < 0.0))
        norms = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
        moving = ~outward & (norms > 0.0)
        scaled = jacobian[:, moving] / norms[moving]
        normal = scaled.T @ scaled
        improved = False
        while damping < 1e8:
            step = np.linalg.solve(
                normal + damping * np.eye(normal.shape[0]), -gradient[moving] / norms[moving]
            )
            trial = p.copy()
            trial[free[moving]] += step / norms[moving]
            trial = np.clip(trial, low, high)
            trial_residual = problem.residual(trial)
            trial_loss = float(trial_residual @ trial_residual)
            if trial_loss < loss:
                improved = True
                break
            damping *= 8.0
        if not improved:
            break
        slow = slow + 1 if loss - trial_loss < max(_CONVERGED, _CONVERGED_RELATIVE * trial_loss) else 0
        p, residual, loss = trial, trial_residual, trial_loss
        damping = max(damping / 8.0, 1e-10)
        if slow == 2 or loss < _CONVERGED:
            break
    return loss, p


def _entries(problem: Problem, p: Vector, free: Vector) -> Iterator[Vector]:
    """Ways into the fit of a whole record.

    The turning point at which a mass stays is a discontinuous function of the parameters, and a descent
    that begins with one half cycle too many or too few never leaves it. So the motion is fitted first,
    and friction then nudged by fractions of a half cycle's drop until the rest position comes out.
    """
    if not math.isfinite(problem.rest_time):
        yield p
        return
    if _INDEX["static_excess"] in free:
        yield p  # the one effect whose trace may lie in the stop itself, which the motion does not show
    resting = problem.times >= problem.rest_time
    moving = problem.times < problem.rest_time - 1.5 * math.pi
    _, p = _minimise(replace(problem, used=problem.used & moving), p, free)
    yield p
    step = math.pi / problem.rest_time / 16.0
    nudged = []
    for nudge in range(-8, 9):
        trial = p.copy()
        trial[1] *= 1.0 + nudge * step
        residual = problem.residual(trial)[resting]
        nudged.append((float(residual @ residual), abs(nudge), nudge))
    if (nudge := min(nudged)[2]) != 0:
        p = p.copy()
        p[1] *= 1.0 + nudge * step
        yield p


def _line_starts(problem: Problem, p: Vector) -> Iterator[Vector]:
    """Start a line at the residual's two highest spectral peaks, and within resolution of the motion's."""
    residual = problem.residual(p)
    spacing = problem.times[1] - problem.times[0]
    size = 4 * problem.times.size
    power = np.abs(np.fft.rfft(residual, size)) ** 2
    omega = 2.0 * np.pi * np.fft.rfftfreq(size, spacing)
    power[omega * problem.times[-1] < _SHORTEST_LINE] = 0.0
    resolution = 2.0 * np.pi / problem.times[-1]
    lines = [p[0] - 0.3 * resolution, p[0] + 0.3 * resolution]
    for _ in range(2):
        peak = int(np.argmax(power[1:-1])) + 1
        lines.append(omega[peak])
        power[max(peak - 8, 0) : peak + 9] = 0.0
    for line in lines:
        start = p.copy()
        start[_INDEX["line_frequency"]] = line
        waves = np.column_stack([np.sin(line * problem.times), np.cos(line * problem.times)])
        waves *= (math.sqrt(problem.weight) / problem.noise_sd * problem.used)[:, None]
        amplitudes, *_ = np.linalg.lstsq(waves, residual, rcond=None)
        start[[_INDEX["sine"], _INDEX["cosine"]]] = amplitudes
        yield start


def _starts(problem: Problem, name: str, p: Vector) -> Iterator[Vector]:
    """Starts for adding one effect to a smaller model fitted at ``p``."""
    if name == "periodic_interference":
        yield from _line_starts(problem, p)
    elif name == "stribeck_friction":
        for velocity in (0.07, 0.4):
            start = p.copy()
            start[_INDEX["static_excess"]] = 0.2
            start[_INDEX["log_stribeck_velocity"]] = math.log(velocity)
            yield start
    else:
        yield p


def fit_set(
    problem: Problem, effects: frozenset[str], bases: dict[frozenset[str], Vector], guess: Vector
) -> tuple[float, Vector]:
    """Lowest chi-square loss of a set of effects, and its parameters.

    Parameters
    ----------
    problem : Problem
        What to imitate.
    effects : frozenset of str
        The rival; clipping and outliers free no parameter here.
    bases : dict
        Parameters of smaller sets already fitted; each one with one effect less is a start.
    guess : ndarray
        Start where there is no smaller set.
    """
    names = sorted(effects & _FREED.keys())
    freed = {parameter for name in names for parameter in _FREED[name]}
    free = np.array([*_ALWAYS, *sorted(_INDEX[parameter] for parameter in freed)])
    starts = [
        start
        for name in names
        if effects - {name} in bases
        for start in _starts(problem, name, bases[effects - {name}])
    ] or [guess]
    best = (math.inf, guess)
    absent = np.setdiff1d(np.arange(4, len(ALL_PARAMETERS)), free)
    for start in starts:
        cut = start.copy()
        cut[absent] = physical_parameters()[absent]
        for entry in _entries(problem, cut, free):
            best = min(best, _minimise(problem, entry, free), key=lambda pair: pair[0])
        if best[0] < _CONVERGED:
            break
    return best
