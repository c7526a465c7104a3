"""Effects on the torque of an axis without a cable, or of a direct drive; one per file.

Each file defines ``EFFECT``, which :func:`winchkit.load_catalogue` collects.
"""
