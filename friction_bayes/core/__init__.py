"""What everything else builds on: the declared system, quantities and units, errors, checks, files, text."""
