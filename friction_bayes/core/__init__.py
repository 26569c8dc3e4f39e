"""What everything else stands on: the declared system, quantities and units, errors, checks, files, text."""
