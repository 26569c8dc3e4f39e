"""The posterior of a law under a random force as a sampler evaluates it, and records drawn from the model."""
