"""The free decay in a record: where it starts and ends, its phase, half cycles and turning points."""
