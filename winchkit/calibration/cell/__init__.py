"""Calibration of load cells by known weights: order of weighing, fit, files, health.

``weighing_order`` proposes the sequence of loads, ``files`` reads and writes points and
calibrations, ``health`` tests a cell from a few seconds of readings.
:func:`~winchkit.calibration.cell.fit.fit_cell` is the entry.
"""
