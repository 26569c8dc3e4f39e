"""The systems: a mass or inertia on a spring, and a pendulum; Eqs. (1) and (2) of the paper."""

from __future__ import annotations

import math
from dataclasses import InitVar, dataclass
from typing import Any, ClassVar, Self

from friction_bayes.core.checks import in_unit, non_negative, positive
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import STANDARD_GRAVITY, Quantity

__all__ = ["Oscillator", "Pendulum", "check_system"]


@dataclass(frozen=True, kw_only=True)
class Oscillator:
    """A single-degree-of-freedom system with dry friction, ``m x'' + r sign(x') + k x = 0``.

    Give either ``mass`` (linear motion) or ``inertia`` (rotation). Values are plain numbers in the units
    below, or quantities that convert themselves to these, such as those of pint.

    Parameters
    ----------
    mass : float, optional
        Moving mass [kg].
    inertia : float, optional
        Moment of inertia about the axis [kg m2].
    stiffness : float
        Spring stiffness [N/m, or N m/rad].
    mass_sd, inertia_sd, stiffness_sd : float
        Standard deviations, same units; zero means taken as exact, and results say so.
    trust : {"stiffness", "mass", "inertia"}, optional
        The declared value that friction is computed with, whatever the other one is; left out, friction
        spans both where the record does not swing at the frequency that they imply (see
        :func:`friction_bayes.core.declared_force.declared_forces`).

    Raises
    ------
    InputError
        If a value is not a positive and finite number in its unit, a standard deviation is larger than its
        value, mass and inertia are both given or both missing, or ``trust`` names neither value given.
    """

    mass: float | None = None
    inertia: float | None = None
    stiffness: float
    mass_sd: float = 0.0
    inertia_sd: float = 0.0
    stiffness_sd: float = 0.0
    trust: str | None = None

    pendulum: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if (self.mass is None) == (self.inertia is None):
            given = "neither" if self.mass is None else "both"
            raise InputError("system", f"{given} of mass and inertia given", "give exactly one of them")
        for name in (self.moving_name, "stiffness"):
            self._set(name, positive(name, in_unit(name, getattr(self, name), self.unit_of(name))))
        for name in ("mass_sd", "inertia_sd", "stiffness_sd"):
            value = in_unit(name, getattr(self, name), self.unit_of(name.removesuffix("_sd")))
            self._set(name, non_negative(name, value))
        other = "mass_sd" if self.mass is None else "inertia_sd"
        if getattr(self, other):
            raise InputError(other, "belongs to the other kind of system", f"leave out {other}")
        for name in (self.moving_name, "stiffness"):
            value, sd = getattr(self, name), getattr(self, f"{name}_sd")
            if sd > value:
                raise InputError(
                    f"{name}_sd",
                    f"{sd:g} is larger than the {name} itself, {value:g}",
                    f"give the standard deviation in the unit of the {name}",
                )
        if self.trust not in (None, "stiffness", self.moving_name):
            raise InputError(
                "trust", f"{self.trust!r} is not declared", f"give stiffness or {self.moving_name}"
            )

    @classmethod
    def from_frequency(
        cls, frequency: float, *, mass: float | None = None, inertia: float | None = None, **others: Any
    ) -> Self:
        """Declare a system by the natural frequency of its small motion, ``k = m (2 pi f)^2``.

        Parameters
        ----------
        frequency : float
            [Hz].
        mass, inertia : float, optional
            One of them [kg, kg m2].
        **others
            As the class has them: ``mass_sd``, ``inertia_sd``, ``stiffness_sd``, ``trust``.

        Raises
        ------
        InputError
            As the class; also where the frequency is not a positive and finite number.
        """
        rate = 2.0 * math.pi * positive("frequency", in_unit("frequency", frequency, "Hz"))
        # of neither or both, and of what is no number, the class itself says what is wrong
        name, unit, given = ("inertia", "kg*m**2", inertia) if mass is None else ("mass", "kg", mass)
        moving = 1.0 if given is None else positive(name, in_unit(name, given, unit))
        return cls(mass=mass, inertia=inertia, stiffness=moving * rate**2, **others)

    def _set(self, name: str, value: float | None) -> None:
        """Set a field of the frozen class while it is made."""
        object.__setattr__(self, name, value)

    def unit_of(self, name: str) -> str:
        """Unit of ``mass``, ``inertia`` or ``stiffness``, as unit packages spell it."""
        return {"mass": "kg", "inertia": "kg*m**2"}.get(name, "N*m" if self.angular else "N/m")

    @property
    def angular(self) -> bool:
        """Whether the motion is a rotation."""
        return self.mass is None

    @property
    def moving_name(self) -> str:
        """``mass`` or ``inertia``."""
        return "inertia" if self.angular else "mass"

    @property
    def moving(self) -> float:
        """Mass [kg] or inertia [kg m2]."""
        value = self.inertia if self.mass is None else self.mass
        assert value is not None
        return value

    @property
    def moving_sd(self) -> float:
        """Standard deviation of :attr:`moving`."""
        return self.inertia_sd if self.angular else self.mass_sd

    @property
    def natural_frequency(self) -> float:
        """``w0 = sqrt(k/m)`` [rad/s], of small motion."""
        return math.sqrt(self.stiffness / self.moving)

    @property
    def friction_unit(self) -> str:
        """``N`` or ``N m``."""
        return "N m" if self.angular else "N"

    @property
    def length_unit(self) -> str:
        """``m`` or ``rad``."""
        return "rad" if self.angular else "m"

    @property
    def displacement_scale(self) -> float:
        """The system's own scale of motion, from which default priors are derived.

        The static deflection under its own weight, ``m g / k`` [m]; one radian for a rotation.
        """
        return 1.0 if self.angular else self.moving * STANDARD_GRAVITY / self.stiffness

    def envelope_slope(self, friction: float) -> float:
        """Slope of the amplitude envelope, ``y = 2 r w0 / (pi k)``, Eq. (2) [m/s]."""
        return 2.0 * friction * self.natural_frequency / (math.pi * self.stiffness)

    def friction_from_slope(self, slope: float) -> float:
        """Friction force for an envelope slope [m/s], Eq. (2) solved for ``r``."""
        return slope * math.pi * self.stiffness / (2.0 * self.natural_frequency)

    def force_factor(self, quantity: Quantity) -> float:
        """Factor from the signal's friction coefficient to the friction force.

        In a signal of derivative order ``q`` friction shows as ``u = w0**q r/k``; the factor is
        ``k`` for displacement, ``sqrt(k m)`` for velocity and ``m`` for acceleration.
        """
        q = quantity.order / 2.0
        return self.stiffness ** (1.0 - q) * self.moving**q

    def force_factor_relative_sd(self, quantity: Quantity) -> float:
        """Relative standard deviation of :meth:`force_factor` from those of stiffness and mass."""
        q = quantity.order / 2.0
        return math.hypot(
            (1.0 - q) * self.stiffness_sd / self.stiffness,
            q * self.moving_sd / self.moving,
        )


@dataclass(frozen=True, kw_only=True)
class Pendulum(Oscillator):
    """A pendulum: inertia about the pivot and restoring torque ``k sin(angle)``.

    ``stiffness`` is the gravity torque per ``sin(angle)``, i.e. ``mass * g * arm`` [N m]. A simple pendulum
    is declared by its ``length`` and ``mass`` instead: all of the mass at the end of a rod without weight.

    Parameters
    ----------
    length : float, optional
        From the pivot to the mass [m].
    """

    stiffness: float = math.nan
    length: InitVar[float | None] = None

    pendulum: ClassVar[bool] = True

    def __post_init__(self, length: float | None) -> None:
        if length is not None:
            self._take_length(positive("length", in_unit("length", length, "m")))
        elif _is_nan(self.stiffness):
            raise InputError(
                "system",
                "neither stiffness nor length given",
                "give inertia and stiffness, or length and mass",
            )
        super().__post_init__()
        if not self.angular:
            raise InputError("system", "a pendulum declared with a mass", "give its inertia about the pivot")

    def _take_length(self, length: float) -> None:
        """Inertia and stiffness of a simple pendulum, ``m l^2`` and ``m g l``."""
        if self.mass is None and self.inertia is None and _is_nan(self.stiffness):
            raise InputError(
                "mass",
                "missing: the friction torque of a pendulum is in proportion to it",
                "give it with the length; with 1 kg, friction is the torque per kilogram",
            )
        if self.mass is None or self.inertia is not None or not _is_nan(self.stiffness):
            raise InputError(
                "length",
                "declares a simple pendulum, whose inertia and stiffness follow from its mass",
                "give length and mass alone, or inertia and stiffness without a length",
            )
        mass = positive("mass", in_unit("mass", self.mass, "kg"))
        self._set("mass", None)
        self._set("inertia", mass * length**2)
        self._set("stiffness", mass * STANDARD_GRAVITY * length)


def check_system(system: Oscillator) -> Oscillator:
    """Return the system, refusing anything else."""
    if not isinstance(system, Oscillator):
        raise InputError(
            "system",
            f"{type(system).__name__} instead of an Oscillator or a Pendulum",
            "declare it, such as Oscillator(mass=10.0, stiffness=1000.0)",
        )
    return system


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)
