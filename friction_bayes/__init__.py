"""Friction from free decay: closed-form Bayesian estimators checked against MCMC."""
