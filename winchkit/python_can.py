"""python-can, imported without the packages of its MF4 log format.

python-can imports asammdf where it is installed (extra ``mf4``), and with it pandas, canmatrix and
openpyxl: more CPU time than all else in the start of a process that opens a bus, which uses none
of them.
"""

from __future__ import annotations

import sys


def import_python_can() -> None:
    """Import ``can``, if it is not imported yet, as without asammdf.

    Notes
    -----
    The MF4 reader and writer of python-can are then not available in the process. A program that
    uses them imports ``can`` before winchkit.
    """
    if "can" in sys.modules or "asammdf" in sys.modules:
        return
    sys.modules["asammdf"] = None  # type: ignore[assignment]  # import raises ImportError
    try:
        import can  # noqa: F401
    finally:
        del sys.modules["asammdf"]
