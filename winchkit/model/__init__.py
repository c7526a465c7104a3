"""The physics of a winch and its rope, numpy only.

``drum`` and ``gearbox`` turn motor angle into wound length; ``friction`` holds pulley laws;
``recurrence`` holds what has memory; ``line`` chains them into predictions.
"""
