"""A law that is simulated and fitted to whole records: Coulomb friction alone, and laws to be compared."""
