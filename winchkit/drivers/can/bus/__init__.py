"""A CAN bus: interface, receive thread, health counters and load.

:class:`~winchkit.drivers.can.bus.bus.CanBus` distributes frames by identifier;
it interprets no protocol.
"""
