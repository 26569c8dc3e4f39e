"""Candidates along the measured motions: rounds until a law converges, one record or several, and draws."""
