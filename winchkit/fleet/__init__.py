"""Many winches at many dates: libraries of runs, their diagnoses, and changes over time.

``library`` indexes a folder of runs and diagnoses it, ``diagnosis`` compares the winches and finds
what changed; ``report``, ``web`` and ``cli`` are the fleet's parts of the packages of these names.
Each name is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from winchkit.fleet.diagnosis.diagnose import diagnose_each
    from winchkit.fleet.library.diagnose import diagnose_library
    from winchkit.fleet.library.history import LibraryHistory, library_history
    from winchkit.fleet.library.index import index_library
    from winchkit.fleet.library.query import library_estimates, library_runs, query_library

__all__ = [
    "LibraryHistory",
    "diagnose_each",
    "diagnose_library",
    "index_library",
    "library_estimates",
    "library_history",
    "library_runs",
    "query_library",
]

_NAMES = {
    "winchkit.fleet.diagnosis.diagnose": ("diagnose_each",),
    "winchkit.fleet.library.diagnose": ("diagnose_library",),
    "winchkit.fleet.library.history": ("LibraryHistory", "library_history"),
    "winchkit.fleet.library.index": ("index_library",),
    "winchkit.fleet.library.query": ("library_estimates", "library_runs", "query_library"),
}
_HOME = {name: module for module, names in _NAMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOME:
        raise AttributeError(f"module 'winchkit.fleet' has no attribute '{name}'")
    value = globals()[name] = getattr(import_module(_HOME[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
