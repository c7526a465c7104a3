"""Errors of a serial port that was pulled out."""

from __future__ import annotations

UNPLUGGED: tuple[type[Exception], ...] = (OSError,)
"""SerialException is an OSError; ``termios.error``, from a port's settings, is none."""
try:
    import termios
except ImportError:  # on Windows
    pass
else:
    UNPLUGGED += (termios.error,)
