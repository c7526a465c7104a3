"""Calibration: parameters with uncertainties from measurements made for them.

``cell`` fits the curve of a load cell to known weights. ``robot`` fits the geometry and the winches
of a cable robot to measured poses; its solver
(:mod:`winchkit.robot.identification.bundle_adjustment`) and its equations also serve the
diagnosis of robots. The public functions are :func:`~winchkit.calibration.cell.fit.fit_cell` and
:func:`winchkit.calibrate`.
"""
