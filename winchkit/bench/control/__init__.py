"""The control loop of a bench: motion, supervision, stops, and the latch.

``motion`` computes targets, ``controller`` commands one drive, ``supervisor`` tests the table of
``conditions``, ``stop_escalation`` orders the ways to stop a drive, ``latch`` stores trips in a
file. :class:`~winchkit.bench.control.loop.ControlLoop` runs one cycle after the other and publishes
a :class:`winchkit.BenchSnapshot`.
"""
