"""Commands for CANopen nodes: scan, info, config, LSS and bus load.

They work on a bus that nobody owns, or through the owner of the bench.
"""
