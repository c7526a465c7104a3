"""Simulated load cells and encoders behind CANopen, Modbus and serial lines."""
