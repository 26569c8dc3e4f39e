"""Recordings as an ordinary laboratory makes them, by a simulator that shares no code with the package."""
