"""Calibration: parameters with uncertainties from measurements made for them.

``cell`` fits the curve of a load cell to known weights:
:func:`~winchkit.calibration.cell.fit.fit_cell`. That of cable robots is in their wing.
"""
