"""Dynamics of cable robots: motion, integration, and what control computes each cycle."""
