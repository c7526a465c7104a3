"""Simulated load cells and encoders behind CANopen, Modbus and serial lines.

``instrument`` is their conversion, tare and faults; the other files are a protocol each.
"""
