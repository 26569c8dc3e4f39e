"""Prior and posterior
===================

What 16 friction samples say of friction and precision, as in Fig. 2 of the paper.
"""

import matplotlib.pyplot as plt

import friction_bayes as fb
from friction_bayes.plotting import paper

system = fb.Oscillator(mass=10.0, stiffness=1000.0)
release = {"initial_displacement": 0.0147, "duration": 10.0, "sampling_rate": 100.0, "noise_sd": 5e-4}
record = fb.simulate(system, friction=0.07, seed=1, **release)
prior = {"mu": 0.5, "lam": 0.05, "alpha": 1.0, "beta": 0.02}  # one that can be drawn
estimate = fb.estimate(record, system, method="normal-gamma", prior=prior)
_, axes = plt.subplots(1, 2, figsize=(9.0, 4.0), layout="constrained")
paper.prior_and_posterior(estimate, truth=0.07, axes=axes)
