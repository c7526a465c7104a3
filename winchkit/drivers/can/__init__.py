"""CANopen: the bus, SDO nodes, PDO codec, heartbeats, emergencies and the CiA 402 axis."""
