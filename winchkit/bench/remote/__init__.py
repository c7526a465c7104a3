"""Stations: how other processes take part in a bench, and the process that owns it for them."""
