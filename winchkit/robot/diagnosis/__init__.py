"""Diagnosis of cable robots: effects that are missing from a robot's model, from its poses.

:func:`~winchkit.robot.diagnosis.diagnose.diagnose` is the entry; poses and geometry are estimated
by the solver of the calibration.
"""
