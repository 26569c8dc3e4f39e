"""How a system is declared: by numbers, by quantities with a unit, by frequency or by length."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import pytest

import friction_bayes as fb
from friction_bayes.core.quantities import STANDARD_GRAVITY
from friction_bayes.core.system import check_system


@dataclass(frozen=True)
class Quantity:
    """A number with a unit, as packages of units have it."""

    magnitude: float
    unit: str

    def to(self, unit: str) -> Quantity:
        factors = {("g", "kg"): 1e-3, ("kN/m", "N/m"): 1e3, ("cm", "m"): 1e-2}
        if (self.unit, unit) not in factors:
            raise ValueError(f"cannot convert {self.unit} to {unit}")
        return Quantity(self.magnitude * factors[self.unit, unit], unit)

    def __str__(self) -> str:
        return f"{self.magnitude} {self.unit}"


def test_quantities_convert_themselves() -> None:
    system = fb.Oscillator(mass=Quantity(250.0, "g"), stiffness=Quantity(2.0, "kN/m"))
    assert system == fb.Oscillator(mass=0.25, stiffness=2000.0)


def test_a_quantity_of_another_kind_is_refused() -> None:
    with pytest.raises(fb.InputError, match=r"mass: 3\.0 cm is not in kg: cannot convert cm to kg"):
        fb.Oscillator(mass=Quantity(3.0, "cm"), stiffness=1.0)


def test_text_is_no_number() -> None:
    with pytest.raises(fb.InputError, match="mass: '10' is not a number"):
        fb.Oscillator(mass="10", stiffness=1000.0)  # type: ignore[arg-type]


@pytest.mark.parametrize("moving", [{"mass": 3.0}, {"inertia": 0.2}])
def test_a_frequency_gives_the_stiffness(moving: dict[str, float]) -> None:
    system = fb.Oscillator.from_frequency(1.5, **moving, stiffness_sd=0.1)
    assert system.natural_frequency == pytest.approx(3.0 * math.pi, rel=1e-15)
    assert system.stiffness_sd == 0.1
    assert system.moving == next(iter(moving.values()))


@pytest.mark.parametrize(
    ("frequency", "moving", "message"),
    [
        (-1.0, {"mass": 1.0}, "frequency: -1 is not positive"),
        (1.0, {}, "neither of mass and inertia given"),
        (1.0, {"mass": 1.0, "inertia": 1.0}, "both of mass and inertia given"),
        (1.0, {"mass": 0.0}, "mass: 0 is not positive"),
    ],
)
def test_what_gives_no_system_by_frequency_is_refused(
    frequency: float, moving: dict[str, float], message: str
) -> None:
    with pytest.raises(fb.InputError, match=message):
        fb.Oscillator.from_frequency(frequency, **moving)


def test_a_simple_pendulum_by_its_length() -> None:
    system = fb.Pendulum(length=Quantity(80.0, "cm"), mass=0.5)
    assert system == fb.Pendulum(inertia=0.5 * 0.8**2, stiffness=0.5 * 0.8 * STANDARD_GRAVITY)
    assert system.natural_frequency == pytest.approx(math.sqrt(STANDARD_GRAVITY / 0.8))
    assert replace(system, trust="stiffness").inertia == system.inertia


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ({"length": 1.0}, "mass: missing.*give it with the length"),
        ({"length": 1.0, "mass": 1.0, "stiffness": 2.0}, "length and mass alone"),
        ({"inertia": 1.0}, "neither stiffness nor length given"),
        ({"length": 0.0, "mass": 1.0}, "length: 0 is not positive"),
        ({"mass": 1.0, "stiffness": 1.0}, "a pendulum declared with a mass"),
    ],
)
def test_what_is_no_pendulum_is_refused(declared: dict[str, float], message: str) -> None:
    with pytest.raises(fb.InputError, match=message):
        fb.Pendulum(**declared)


def test_what_is_no_system_is_refused() -> None:
    with pytest.raises(fb.InputError, match=r"system: tuple instead of an Oscillator .*Oscillator\(mass="):
        check_system((10.0, 1000.0))  # type: ignore[arg-type]
