"""Instruments of a bench by name: readings, commands, tares, calibrations and reports.

``instruments`` opens those of a bench file, ``tasks`` has the operations of ``winchkit cell``,
``tares`` stores a tare on the host or in the device. :class:`~winchkit.bench.cells.desk.CellDesk`
is the entry.
"""
