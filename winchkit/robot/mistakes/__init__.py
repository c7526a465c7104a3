"""Mistakes in tables of poses: exchanged columns, signs, shifted rows, axes, units, conventions.

:func:`~winchkit.robot.mistakes.search.refuse_mistakes` is the entry.
"""
