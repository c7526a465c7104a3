"""Calibration: parameters with uncertainties from measurements made for them.

``cell`` fits the curve of a load cell to known weights. That of cable robots is in their wing.
"""
