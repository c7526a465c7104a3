"""Optional libraries, each installed by an extra of winchkit."""

from __future__ import annotations

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
