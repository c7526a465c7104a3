"""Access to single drives of a bench, open or not, and the load of its CAN buses.

``node_access`` reads and writes objects through the owner of the bench, else on the bus;
``bus_load`` computes the frames of a bench file.
:func:`~winchkit.bench.drives.node_access.drive_at` is the entry.
"""
