"""Time and accuracy of the two solvers: 33 s at 1 kHz, 105 half cycles."""

from __future__ import annotations

import numpy as np

from friction_bayes.mechanics.coulomb import coulomb_decay
from friction_bayes.mechanics.effects import force_vector
from friction_bayes.mechanics.integrate import propagate
from friction_bayes.mechanics.testbed import PAPER_FRICTION, PAPER_RELEASE, PAPER_SYSTEM

EFFECTS = {
    "none": {},
    "viscous_damping": {"viscous_damping": (0.001,)},
    "stribeck_friction": {"stribeck_friction": (0.5, 0.05)},
}


class Solvers:
    """The exact solution, and the integrator by tolerance and effect."""

    params = ([1e-8, 1e-11], list(EFFECTS))
    param_names = ("rtol", "effect")

    def setup(self, rtol, effect):
        self.time = np.arange(33_000) / 1000.0
        self.vector = force_vector(EFFECTS[effect])
        self.exact = coulomb_decay(PAPER_SYSTEM, PAPER_FRICTION, PAPER_RELEASE, 0.0, self.time)
        self.integrated(rtol)

    def integrated(self, rtol):
        mass, stiffness = PAPER_SYSTEM.moving, PAPER_SYSTEM.stiffness
        return propagate(
            self.time, PAPER_RELEASE, 0.0, PAPER_FRICTION, mass, stiffness, False, 33.0, self.vector, rtol, 0
        )

    def time_integrator(self, rtol, effect):
        self.integrated(rtol)

    def time_exact(self, rtol, effect):
        coulomb_decay(PAPER_SYSTEM, PAPER_FRICTION, PAPER_RELEASE, 0.0, self.time)

    def track_error_over_amplitude(self, rtol, effect):
        """Largest displacement error against the exact solution; of Coulomb friction alone."""
        if effect != "none":
            raise NotImplementedError
        return float(np.max(np.abs(self.integrated(rtol)[1] - self.exact.displacement)) / PAPER_RELEASE)
