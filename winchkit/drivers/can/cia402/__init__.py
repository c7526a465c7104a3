"""Drives after CiA 402: state machine, modes, units, feedback, commands and stop."""
