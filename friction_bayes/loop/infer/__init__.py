"""Candidates along the measured motions: rounds in which a law settles, one record or several, and draws."""
