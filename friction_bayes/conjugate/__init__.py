"""The conjugate pairs and their likelihoods, free of mechanics: prior, update, predictive, target."""
