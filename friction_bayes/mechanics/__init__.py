"""Mechanics of free decay: systems, the exact Coulomb decay, the effect catalogue, the integrator."""
