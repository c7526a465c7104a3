"""Motion of a robot's platform by the winches of a bench.

``path`` joins lines and arcs, ``trajectory`` plans speeds along them and computes cables and
forces, ``checks`` compares these with the limits, ``motion`` evaluates them once a cycle,
``tension_trim`` corrects the cable forces at their end, and
:class:`~winchkit.robot.bench.platform.Platform` is the entry.
"""
