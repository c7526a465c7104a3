"""Drivers: CiA 402 drives on CAN, and instruments on CAN, Modbus and serial lines.

``can`` has the bus and the drives, ``modbus`` and ``stream`` the lines of instruments, which
``instrument_process`` serves in a process of their own; the files here have their common parts:
clock, threads, publishing and counting of readings. A bench uses
:class:`~winchkit.drivers.can.cia402.axis.Cia402Axis` and
:class:`~winchkit.drivers.slow.SlowDevices`.
"""
