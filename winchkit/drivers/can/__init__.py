"""CAN: the bus, CANopen services, CiA 402 drives, host loss, and tools."""

from winchkit.python_can import import_python_can

import_python_can()
