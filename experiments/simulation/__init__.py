"""Laws fitted by simulating their motion with all effects, to compare those along a motion with."""
