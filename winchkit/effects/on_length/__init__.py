"""Effects on the cable length, from the motor angle on.

:func:`winchkit.load_catalogue` collects the effects of every file.
"""
