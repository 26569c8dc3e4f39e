"""The loop with a force that fluctuates: sets of effects weighed along the measured motion."""
