"""Questions put to the estimators, one module each; ``python -m experiments.NAME`` answers one."""
