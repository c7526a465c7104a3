"""A simulated bench on real buses: plants, drives and instruments, for other processes."""

from winchkit.python_can import import_python_can

import_python_can()
