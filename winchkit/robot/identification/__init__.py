"""Identification of a cable robot: poses and parameters from measured lengths and poses.

A robot as a function of its ``parameters`` (with those of ``instruments``, and effects), the
``equations`` of its poses, their ``bundle_adjustment``, the ``variance_components`` of the readings
and the design of further poses. A calibration fits geometry, winches and instruments; a diagnosis
has effects for further parameters.
"""
