"""CAN: the bus, CANopen services, CiA 402 drives, host loss, and tools.

``bus`` moves frames, ``canopen`` has the services of CiA 301, ``cia402`` the drives, ``host_loss``
their watchdogs, ``tools`` scan and settings; ``process_value`` is an instrument after CiA 404.
"""

from winchkit.extras import import_python_can

import_python_can()
