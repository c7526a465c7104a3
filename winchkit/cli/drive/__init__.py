"""Commands for CANopen nodes: scan, info, config, LSS and bus load.

They work on a bus without owner, or through the owner of the bench.
"""
