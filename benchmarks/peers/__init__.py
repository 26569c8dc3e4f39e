"""This package next to others that do parts of its work: one file a question, one command for the page."""
