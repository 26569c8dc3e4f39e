"""Recordings: what a record is, what may be wrong with one, how it is read, written and fetched by name."""
