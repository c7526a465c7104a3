"""Declarations of devices: CiA 402 drives and instruments on CANopen, Modbus and serial lines.

Plain frozen dataclasses; one device file declares one device.
"""
