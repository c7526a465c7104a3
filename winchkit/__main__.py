"""The program ``winchkit``, and ``python -m winchkit``: the command line.

A Ctrl-C while the command line is imported ends like every other, with a line instead of a
traceback.
"""

from __future__ import annotations

import sys


def program() -> None:
    """Import the command line and run it."""
    try:
        from winchkit.cli import main
    except KeyboardInterrupt:
        sys.stderr.write("winchkit: interrupted\n")
        sys.exit(130)
    main(prog_name="winchkit")


if __name__ == "__main__":
    program()
