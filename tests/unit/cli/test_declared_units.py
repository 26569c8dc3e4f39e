"""A system in other units than SI is known by its frequency."""

from __future__ import annotations

import math

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.cli.declared_units import check_declared_units
from friction_bayes.records.record import make_record

TIME = np.arange(1500) / 150.0
SIGNAL = 0.4 + 0.01 * np.cos(20.0 * TIME) * (1.0 - 0.09 * TIME)


@pytest.mark.parametrize(
    ("system", "message"),
    [
        (
            fb.Oscillator(mass=2500.0, stiffness=1000.0),
            r"3\.\d+ Hz is 3\d\.?\d* times .* mass and stiffness give, 0\.101 Hz: in g or N/mm\?; give kg",
        ),
        (fb.Oscillator(mass=2.5, stiffness=1.05), r"in g or N/mm\?; give kg and N/m$"),
        (
            fb.Oscillator(inertia=250.0, stiffness=10.0),
            r"inertia and stiffness .* g m2, kg cm2 or g cm2\?; give kg m2 and N m/rad$",
        ),
    ],
)
def test_other_units_are_named(system: fb.Oscillator, message: str) -> None:
    quantity = "angle" if system.angular else "displacement"
    with pytest.raises(fb.InputError, match=message):
        check_declared_units(make_record(TIME, SIGNAL, quantity), system)


@pytest.mark.parametrize("factor", [1.0, 7.0, 300.0, 1.0 / 1000.0])
def test_other_frequencies_are_left_to_others(factor: float) -> None:
    system = fb.Oscillator(mass=2.5 * factor, stiffness=1000.0)
    check_declared_units(make_record(TIME, SIGNAL, "displacement"), system)


def test_a_record_long_enough_may_be_of_the_declared_frequency() -> None:
    """Hum may be the stronger one where the motion has long ended."""
    hum = math.sqrt(1000.0)
    time = np.arange(20_000) / 1000.0
    signal = 0.01 * np.cos(time) * np.exp(-time) + 0.02 * np.cos(hum * time)
    check_declared_units(make_record(time, signal, "displacement"), fb.Oscillator(mass=1.0, stiffness=1.0))
