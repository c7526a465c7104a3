"""Dynamics of cable robots, and what control computes each cycle.

The latter is one pose at a time, in loops that numba compiles where it is installed.
"""
