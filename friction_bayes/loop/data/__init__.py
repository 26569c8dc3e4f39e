"""What a closed loop starts from: prepared records, parameters and the signal that a law predicts."""
