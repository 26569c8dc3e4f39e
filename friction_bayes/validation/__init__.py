"""Statistical tests of posteriors: mixing, agreement, calibration; public as ``friction_bayes.testing``."""
