"""Clocks of several files: joined by time stamps, or by signals that follow each other.

``joint`` puts all channels on the clock of the first file, by channels that follow each other;
``cross_correlation`` is the lag of two signals; ``multilateration`` that of a tracker and the lines
of a robot.
"""
