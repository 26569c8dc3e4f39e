"""Conjugate pairs, one a file, and the estimators built on them."""
