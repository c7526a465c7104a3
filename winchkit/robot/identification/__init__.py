"""Identification of a cable robot: poses and parameters from measured lengths and poses.

A calibration fits geometry, winches and instruments; a diagnosis has effects for further
parameters.
"""
