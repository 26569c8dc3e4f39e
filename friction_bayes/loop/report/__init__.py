"""The report on the candidates: the verdict, friction, parameters, and what to measure next."""
