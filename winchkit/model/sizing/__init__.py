"""Sizing of a winch: the design equations of the winding-device paper (Eq. 10 to 18).

:func:`~winchkit.model.sizing.sizing.sized` evaluates every requirement with its value and limit.
"""
