"""Calibration of cable robots: geometry and winches from poses of which anything was measured.

:func:`~winchkit.robot.calibration.calibrate.calibrate` is the entry.
"""
