"""Accounts of the residual of a decay: white or coloured noise, corners of any shape, a random force."""
