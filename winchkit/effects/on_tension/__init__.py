"""Effects on the tension, from the load to the cell's reading.

:func:`winchkit.load_catalogue` collects the effects of every file.
"""
