"""Logs of a bench while they are recorded."""
