"""Drives after CiA 402: state machine, modes, units, feedback, commands and stop.

:class:`~winchkit.drivers.can.cia402.axis.Cia402Axis` is one drive in the control loop;
:mod:`~winchkit.drivers.can.cia402.commission` brings it from power-on to operational.
"""
