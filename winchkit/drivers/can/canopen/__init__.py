"""CANopen services of CiA 301, 305 and 306, independent of the device profile.

``node`` reads and writes objects by SDO, ``pdo`` packs process data, ``nmt`` supervises heartbeats,
``emergency``, ``lss`` and ``eds`` are a service each.
:class:`~winchkit.drivers.can.canopen.node.SdoNode` is the entry.
"""
