"""Effects on the torque of an axis without a cable, or of a direct drive.

:func:`winchkit.load_catalogue` collects the effects of every file.
"""
