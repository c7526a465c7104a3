"""A process of its own for the instruments on Modbus and serial lines, beside a real-time loop.

``lines`` declares a line and makes it, ``child`` serves lines in the process, ``messages`` has what
passes between the processes, ``separate`` the lines as the bench sees them.
:class:`~winchkit.drivers.instrument_process.process.InstrumentProcess` is the entry.
"""
