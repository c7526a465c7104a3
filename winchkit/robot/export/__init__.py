"""A robot's profile for controllers and simulators: C99, and a model of MuJoCo.

:func:`~winchkit.robot.export.export.export_model` is the entry.
"""
