"""Doubts about the most probable candidate: force left over, forecast, contradictions, and a sampler."""
