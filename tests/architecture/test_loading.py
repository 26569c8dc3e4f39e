"""What is loaded stays light: a sampler or a plot comes only when it is asked for."""

from __future__ import annotations

import subprocess
import sys

HEAVY = ("emcee", "arviz_base", "arviz_stats", "arviz_plots", "matplotlib")


def test_estimating_loads_no_sampler_and_no_plot() -> None:
    script = (
        "import sys, friction_bayes as fb\n"
        "system = fb.Oscillator(mass=10.0, stiffness=1000.0)\n"
        "record = fb.simulate(system, friction=0.5, initial_displacement=0.02, duration=5.0,"
        " sampling_rate=100.0, noise_sd=5e-4, seed=1)\n"
        "fb.estimate(record, system)\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
