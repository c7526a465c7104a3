"""A CAN bus: interface, receive thread, health counters and load; it interprets no protocol."""
