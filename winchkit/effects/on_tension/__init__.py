"""Effects on the tension, from the load to the cell's reading; one per file.

Each file defines ``EFFECT``, which :func:`winchkit.load_catalogue` collects.
"""
