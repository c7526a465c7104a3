"""A simulated bench on real buses: plants, drives and instruments, for other processes.

:mod:`~winchkit.sim.live.bench` assembles it and writes the bench file that opens it.
"""

from winchkit.extras import import_python_can

import_python_can()
