"""Commands about CANopen nodes: scan, info, config, LSS and bus load."""
