"""Geometry of cable robots: cable lengths, and the poses that fit them.

:class:`~winchkit.robot.geometry.robot.Robot` is the entry; ``loops`` are for control.
"""
