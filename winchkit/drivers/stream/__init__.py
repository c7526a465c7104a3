"""Instruments on serial lines: bytes to readings, the port, and the line."""
