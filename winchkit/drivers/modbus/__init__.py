"""Modbus instruments: registers to readings, the guarded client, and the thread that polls."""
