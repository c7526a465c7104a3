"""Modbus instruments: registers to readings, the guarded client, and the polled line.

``client`` and ``frames`` accept exact answers only, ``decoder`` computes a value in SI or NaN,
``consistency`` tests it against the status. :class:`~winchkit.drivers.modbus.line.ModbusLine` is
the entry.
"""
