"""Inputs of a closed loop: prepared records, parameters and the signal that a law predicts."""
