"""Motion of a robot's platform by the winches of a bench.

:class:`~winchkit.robot.bench.platform.Platform` is the entry.
"""
