"""Simulated time: one clock on which a bench, its simulation and their threads advance.

``can_bus``, ``serial_line`` and ``event_loop`` are the media on that clock. The public name is
:class:`winchkit.SimulatedClock`.
"""
