"""Stations: the processes that share a bench, and the process that owns it for them."""
