"""Drivers: CiA 402 drives on CAN, and instruments on CAN, Modbus and serial lines."""
