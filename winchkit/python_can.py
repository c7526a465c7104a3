"""python-can, imported without the packages of its MF4 log format.

python-can imports asammdf where it is installed (extra ``mf4``), and with it pandas, canmatrix and
openpyxl: more CPU time than all else in the start of a process that opens a bus, which uses none
of them.
"""

from __future__ import annotations

import sys


def import_python_can() -> None:
    """Import ``can`` as without asammdf; a program that uses its MF4 imports it before winchkit."""
    if "can" in sys.modules or "asammdf" in sys.modules:
        return
    sys.modules["asammdf"] = None  # type: ignore[assignment]  # import raises ImportError
    try:
        import can  # noqa: F401
    finally:
        del sys.modules["asammdf"]
