"""The paper's figures and a few of our own, one script each: they read results and never estimate.

Fig. 5 of the paper is a photograph of its testbed and has no counterpart here.
"""
