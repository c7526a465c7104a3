"""The physics of a winch and its rope, numpy only.

``drum`` turns drum angle into wound length; ``friction`` holds pulley laws, ``pulleys`` chains of
them; ``recurrence`` holds what has memory; ``line`` chains all into predictions. ``capacity``,
``guide``, ``gearbox`` and ``sizing`` tell what a winch must be for what it has to do.
"""
