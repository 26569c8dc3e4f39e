"""Candidates under noise of the sensor alone: every set is simulated and fitted, led by the residual."""
