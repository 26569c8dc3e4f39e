"""Detection points
================

Friction that wears towards a threshold, as in Fig. 1 of the paper.
"""

import matplotlib.pyplot as plt

import friction_bayes as fb
from friction_bayes.plotting import paper

system = fb.Oscillator(mass=10.0, stiffness=1000.0)
release = {"initial_displacement": 0.0147, "duration": 10.0, "sampling_rate": 100.0, "noise_sd": 5e-4}
records = [fb.simulate(system, friction=r, seed=1, **release) for r in (0.07, 0.078, 0.09, 0.101)]
report = fb.monitor_records(records, system, threshold=0.15, times=[0, 80, 160, 240], time_unit="h")
_, axes = plt.subplots(figsize=(8.0, 4.8), layout="constrained")
paper.detection_points(report, axes=axes)
