"""Effects on the motor torque, from the cable force on; one per file.

Each file defines ``EFFECT``, which :func:`winchkit.load_catalogue` collects.
"""
