"""Modbus instruments: registers to readings, the guarded client, and the polled line."""
