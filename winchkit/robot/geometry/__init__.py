"""Geometry of cable robots: kinematics with swivel pulleys, forward kinematics, poses."""
