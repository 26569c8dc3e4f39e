"""What the report says of the candidates: the verdict, friction, parameters, and what to measure next."""
