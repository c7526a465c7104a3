"""Effects of cable robots: geometry, home lengths and payload; one per file.

Each file defines ``EFFECT``, which :func:`winchkit.load_catalogue` collects.
"""
