"""Calibration of load cells by known weights: order of weighing, fit, files, health.

:func:`~winchkit.calibration.cell.fit.fit_cell` is the entry.
"""
