"""Calibration of cable robots: least squares over all poses and geometric parameters.

:func:`~winchkit.calibration.robot.calibrate.calibrate_robot` fits a profile's numbers to measured
poses, with priors, bounds and a robust loss.
"""
