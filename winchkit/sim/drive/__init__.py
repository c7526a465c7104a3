"""A simulated CiA 402 servo drive, independent of the driver that it tests.

:class:`~winchkit.sim.drive.drive.SimDrive` is the device on the bus: NMT, SDO and PDO (CiA 301),
power state machine and modes of operation (CiA 402), and the motor shaft.
"""
