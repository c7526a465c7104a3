"""Entrants of the benchmark missing_physics: winchkit's diagnosis and methods beside it."""
