"""What the residual of a decay rests on: white or coloured noise, corners of any shape, a random force."""
