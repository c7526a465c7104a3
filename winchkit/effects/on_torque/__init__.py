"""Effects on the motor torque, from the cable force on.

:func:`winchkit.load_catalogue` collects the effects of every file.
"""
