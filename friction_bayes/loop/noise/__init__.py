"""The noise of the sensor: its likelihood, its colour, its growth with the motion, and outliers."""
