"""Effects as columns along the measured motion, and the sets of columns that are evaluated."""
