"""The sealed test of the loop: records whose truth is known here and nowhere else.

Nothing in this package imports the fitted model: motion comes from scipy's DOP853, and the judgement
whether a record can distinguish its effects from others comes from a forward model of its own.
"""
