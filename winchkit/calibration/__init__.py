"""Calibration: parameters with uncertainties from measurements made for them.

``cell`` calibrates load cells by known weights, ``robot`` the geometry of cable robots by poses.
The public function is :func:`winchkit.calibrate`.
"""
