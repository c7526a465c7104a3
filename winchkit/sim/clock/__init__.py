"""Simulated time: one clock on which a bench, its simulation and their threads advance."""
