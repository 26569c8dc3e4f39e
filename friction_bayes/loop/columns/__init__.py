"""A moving record, its effects as columns along the measured motion, and the sets that are evaluated."""
