"""Effects on the cable length, from the motor angle on; one per file.

Each file defines ``EFFECT``, which :func:`winchkit.load_catalogue` collects.
"""
