"""Regression of a free decay under a force that fluctuates."""
