"""Regression of a decay on the columns of its law under a random force: step, filter and sets of columns."""
