"""Forward mechanics: equations of motion, their solutions and integrator, effects, simulated records."""
