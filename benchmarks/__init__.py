"""Time and accuracy, tracked side by side; speed as ratios taken in one run."""
