"""Commands of robots.

``calibrate`` is a command, with ``pose_series`` for a bench; ``plan``, ``run`` and ``check`` are
the robot's parts of the commands of these names.
"""
