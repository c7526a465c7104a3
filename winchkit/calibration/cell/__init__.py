"""Calibration of load cells by known weights: order of weighing, fit, files, health."""
