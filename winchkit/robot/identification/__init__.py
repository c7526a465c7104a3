"""Identification of a cable robot: poses and parameters from measured lengths and poses.

Shared by ``winchkit calibrate`` and ``winchkit diagnose``: the bundle adjustment of poses and
parameters, the second derivatives of the cable lengths, the design of further poses, the estimated
poses, the instrument that measures them, and the variance components of the readings.
"""
