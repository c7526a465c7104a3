"""Optional libraries, each installed by an extra of winchkit, and python-can without one of them.

python-can imports asammdf where it is installed (extra ``mf4``), and with it pandas, canmatrix and
openpyxl: more CPU time than all else in the start of a process that opens a bus, which uses none
of them.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

from winchkit.errors import UsageError

_EXTRAS = {
    "asammdf": ("asammdf", "mf4"),
    "h5py": ("h5py", "hdf5"),
    "mcap_ros2": ("mcap-ros2-support", "ros2"),
    "nptdms": ("npTDMS", "tdms"),
    "openpyxl": ("openpyxl", "xlsx"),
    "pandas": ("pandas", "pandas"),
    "pyarrow": ("pyarrow", "parquet"),
}
"""Package and extra by the name under which the library is imported."""


def library(module: str, user: str) -> Any:
    """A module of an optional library; ``user`` needs it, as the UsageError without it says."""
    try:
        return import_module(module)
    except ImportError:
        package, extra = _EXTRAS[module.partition(".")[0]]
        raise UsageError(
            f"{user} needs {package}; install it with pip install 'winchkit[{extra}]'"
        ) from None


def import_python_can() -> None:
    """Import ``can`` as without asammdf; a program that uses its MF4 imports it before winchkit."""
    if "can" in sys.modules or "asammdf" in sys.modules:
        return
    sys.modules["asammdf"] = None  # type: ignore[assignment]  # import raises ImportError
    try:
        import can  # noqa: F401
    finally:
        del sys.modules["asammdf"]
