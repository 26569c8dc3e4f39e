"""The noise of the sensor: its likelihood with outliers, and what neighbouring samples share of it."""
