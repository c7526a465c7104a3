"""Instruments on serial lines: bytes to readings, the port, and the line.

``framing`` and ``parser`` cut bytes into frames, ``decoder`` computes a value in SI or NaN,
``conversation`` polls. :class:`~winchkit.drivers.stream.line.StreamLine` is the entry.
"""
