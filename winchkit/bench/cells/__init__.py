"""Instruments of a bench by name: readings, commands, tares, calibrations and reports."""
