"""Misbehaving Modbus devices in simulated time, written from the protocol's own text."""
