"""Mistakes in tables of poses: exchanged columns, signs, shifted rows, axes, units, conventions.

``table`` declares the mistakes with the data as they would be without each, ``search`` compares
them, alone and two at a time, and ``adjustment`` fits geometry and poses for one comparison.
"""
