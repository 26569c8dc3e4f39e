"""What an effect is: named parameters with units, supports and priors, and one term."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite
from friction_bayes.core.errors import InputError, unknown_name
from friction_bayes.core.system import Oscillator
from friction_bayes.core.text import listed, words
from friction_bayes.mechanics.effects.prior import Prior, Scales

__all__ = [
    "Effect",
    "Extent",
    "ForceEffect",
    "GrowingNoiseEffect",
    "NoiseEffect",
    "Parameter",
    "ProcessEffect",
    "SensorEffect",
]

_PROBED = 64
"""Samples of a swing at which a distortion is seen to be linear or not."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One parameter of an effect.

    Attributes
    ----------
    name : str
    unit : str
        For linear systems; the word ``signal`` in it means the unit of the signal, ``(signal)`` for that
        with the parentheses that a quotient needs: 1/m, but 1/(m/s).
    angular_unit : str or None
        For rotational systems, where it differs.
    prior : callable, Scales -> Prior
        Weak prior, stated in the effect's file.
    low, high : float
        Support.
    open_low : bool
        Whether ``low`` itself is excluded.
    default : float or None
        Value where none is given; None means it must be given.
    """

    name: str
    unit: str
    prior: Callable[[Scales], Prior]
    angular_unit: str | None = None
    low: float = -math.inf
    high: float = math.inf
    open_low: bool = False
    default: float | None = None

    @property
    def of_force(self) -> bool:
        """Whether it is in proportion to a force, as its unit says; a share of friction is not."""
        return self.unit.startswith(("N", "kg"))

    def unit_in(self, system: Oscillator, signal_unit: str) -> str:
        """Return the unit for a system and a signal."""
        unit = self.angular_unit if system.angular and self.angular_unit is not None else self.unit
        divisor = f"({signal_unit})" if "/" in signal_unit else signal_unit
        return unit.replace("(signal)", divisor).replace("signal", signal_unit)

    def check(self, place: str, value: float) -> float:
        """Return ``value`` as a float, refusing what lies outside the support."""
        number = finite(place, value)
        if number < self.low or number > self.high or (self.open_low and number == self.low):
            left = "(" if self.open_low or self.low == -math.inf else "["
            right = ")" if self.high == math.inf else "]"
            support = f"{left}{self.low:g}, {self.high:g}{right}"
            raise InputError(place, f"{number:g} lies outside its support", f"give a value in {support}")
        return number


class Extent(NamedTuple):
    """How far a series reaches.

    Attributes
    ----------
    parameters : int
        How many of its parameters act, from the first on.
    width : float
        How many times as wide their priors are then as stated.
    """

    parameters: int
    width: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Something that plain Coulomb friction and white noise do not explain.

    Attributes
    ----------
    name : str
    parameters : tuple of Parameter
    summary : str
        The term, in one line.
    excludes : tuple of str
        Effects it never appears together with.
    per_record : bool
        Whether its parameters differ between records: those of the machine do not; those of what begins
        anew with each release, or of the sensor as it was mounted then, do.
    least_swing : float
        Amplitude of the motion below which it cannot be distinguished from another effect [m or rad].
    series : tuple of Extent
        Of a series, how far it may reach, each as probable; empty where all of its parameters act.
    """

    kind: ClassVar[str]

    name: str
    parameters: tuple[Parameter, ...]
    summary: str
    excludes: tuple[str, ...] = ()
    per_record: bool = False
    least_swing: float = 0.0
    series: tuple[Extent, ...] = ()

    def why_not(self, scales: Scales) -> str:
        """Say why a set-up cannot have it or show it apart from others; empty where it may act."""
        if scales.amplitude >= self.least_swing:
            return ""
        unit = "rad" if scales.system.angular else "m"
        return (
            f"a swing of {scales.amplitude:.2g} {unit} does not distinguish it from other effects, "
            f"{self.least_swing:.2g} {unit} would"
        )

    @property
    def widths(self) -> tuple[float, ...]:
        """How many times as wide the priors of its parameters may be."""
        return tuple(sorted({extent.width for extent in self.series})) or (1.0,)

    def priors(self, scales: Scales) -> tuple[Prior, ...]:
        """Return the prior of each parameter."""
        return tuple(parameter.prior(scales) for parameter in self.parameters)

    def values(self, given: Mapping[str, float]) -> tuple[float, ...]:
        """Return checked values in the order of ``parameters``, defaults filled in."""
        known = [parameter.name for parameter in self.parameters]
        for name in given:
            if name not in known:
                raise unknown_name(f"effect {self.name}", "parameter", name, known)
        values = []
        for parameter in self.parameters:
            value = given.get(parameter.name, parameter.default)
            place = f"{self.name}.{parameter.name}"
            if value is None:
                needed = [parameter.name for parameter in self.parameters if parameter.default is None]
                together = " together" if len(needed) > 1 else ""
                raise InputError(place, "is missing", f"give {listed(needed)}{together}")
            values.append(parameter.check(place, value))
        return tuple(values)


@dataclass(frozen=True, kw_only=True)
class ForceEffect(Effect):
    """A force beyond Coulomb friction and the spring.

    Attributes
    ----------
    force : callable
        Compiled with numba: ``force(t, x, v, direction, friction, duration, mass, stiffness, p, i)``
        returns the force [N or N m] on the side of the restoring force,
        ``m x'' = -restoring - friction*direction - force``. ``t`` counts from the start of the record,
        ``duration`` is its length, ``p[i], p[i + 1], ..`` are the parameters. A term that changes sign with
        the velocity uses ``direction`` (+1 or -1, fixed within a half cycle) so that it stays smooth up to
        the velocity zero. Zero parameters mean no force, and it is then not evaluated at all.
    rotational : bool
        Whether it acts on what turns alone.
    resists : bool
        Whether it belongs to the friction force that a load cell measures: a spring's does not.
    largest_swing : float
        Amplitude [rad] above which nothing that turns has it: what depends on the angle repeats with every
        turn.
    """

    kind: ClassVar[str] = "force"

    force: Callable[..., float]
    rotational: bool = False
    resists: bool = True
    largest_swing: float = math.inf

    def why_not(self, scales: Scales) -> str:
        """Say why a system cannot have it or show it apart from others; empty where it may act."""
        if self.rotational and not scales.system.angular:
            return "it acts on what turns, and this moves along a line"
        if scales.system.angular and scales.amplitude > self.largest_swing:
            return f"it does not repeat with every turn, and this swings {scales.amplitude:.2g} rad"
        return super().why_not(scales)


@dataclass(frozen=True, kw_only=True)
class SensorEffect(Effect):
    """An error of the sensor.

    Attributes
    ----------
    distort : callable
        ``distort(signal, time, *values)`` returns the signal as the sensor shows it, shape (n,); time [s]
        counts from the start of the record.
    after_noise : bool
        Whether it acts on the noisy signal.
    quantities : tuple of str
        Quantities whose sensors may have it; empty where those of any may.
    shapes : callable, optional
        ``shapes(size)`` returns what the parameters after the first, which shape the distortion, are taken at
        at a size of the first, in which alone it is linear then.
    """

    kind: ClassVar[str] = "sensor"

    distort: Callable[..., Array]
    per_record: bool = True
    after_noise: bool = False
    quantities: tuple[str, ...] = ()
    shapes: Callable[[float], tuple[tuple[float, ...], ...]] | None = None

    def why_not(self, scales: Scales) -> str:
        """Say why a sensor cannot have it or show it apart from others; empty where it may act."""
        if not self.is_of(scales.quantity.name):
            return f"no sensor of {words(scales.quantity.name)} has it"
        return super().why_not(scales)

    def is_linear(self, scales: Scales) -> bool:
        """Whether the distortion is linear in its parameters, or in the first at given ones after it."""
        taken = () if self.shapes is None else self.shapes(self.priors(scales)[0].scale)[0]
        sizes = np.array([prior.scale for prior in self.priors(scales)[: len(self.parameters) - len(taken)]])
        time = np.linspace(0.0, 20.0 / scales.system.natural_frequency, _PROBED)
        signal = scales.signal * np.cos(scales.system.natural_frequency * time)

        def distorted(sizes: Array) -> Array:
            return np.asarray(self.distort(signal, time, *sizes, *taken) - signal)

        apart = sum((distorted(part) for part in np.diag(sizes)), np.zeros(_PROBED))
        largest = float(np.max(np.abs(apart)))
        if largest == 0.0:
            return False
        off = [float(np.max(np.abs(distorted(k * sizes) - k * apart))) for k in (1.0, 2.0)]
        return max(off) < 1e-9 * (largest + scales.signal)

    def is_of(self, quantity: str) -> bool:
        """Whether sensors of a quantity may have it."""
        return not self.quantities or quantity in self.quantities


@dataclass(frozen=True, kw_only=True)
class NoiseEffect(Effect, ABC):
    """A departure of the noise from independent normal samples of one variance."""

    kind: ClassVar[str] = "noise"

    @abstractmethod
    def contaminate(
        self, noise: Array, signal: Array, rate: Array, rng: np.random.Generator, *values: float
    ) -> Array:
        """Return the noise as it is then, shape (n,).

        Parameters
        ----------
        noise : ndarray, shape (n,)
            Independent samples of one variance.
        signal, rate : ndarray, shape (n,)
            The clean signal about its rest, and its derivative by time.
        rng : numpy.random.Generator
        *values : float
            In the order of the effect's parameters.
        """


@dataclass(frozen=True, kw_only=True)
class GrowingNoiseEffect(NoiseEffect):
    """Noise that grows with the motion, of variance ``sigma^2 + (g size)^2``; ``size`` is its one parameter.

    Attributes
    ----------
    grows_with : callable
        ``grows_with(signal, rate)`` returns ``g``, shape (n,): linear in the signal about its rest and in
        its derivative by time.
    """

    grows_with: Callable[[Array, Array], Array]

    def contaminate(
        self, noise: Array, signal: Array, rate: Array, rng: np.random.Generator, *values: float
    ) -> Array:
        """Return the noise with that which grows."""
        return noise + self.grows_with(signal, rate) * rng.normal(0.0, values[0], noise.size)


@dataclass(frozen=True, kw_only=True)
class ProcessEffect(Effect):
    """A random process that drives the motion in addition to the forces of the law."""

    kind: ClassVar[str] = "process"
