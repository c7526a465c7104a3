"""Many winches at many dates: libraries of runs, their diagnoses, and changes over time.

``library`` indexes a folder of runs and diagnoses it, ``diagnosis`` compares the winches and finds
what changed; ``report``, ``web`` and ``cli`` are the fleet's parts of the packages of these names.
Each name is imported when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from winchkit.wings import homes, lazy

if TYPE_CHECKING:
    from winchkit.fleet.diagnosis.diagnose import diagnose_each as diagnose_each
    from winchkit.fleet.library.diagnose import diagnose_library as diagnose_library
    from winchkit.fleet.library.history import LibraryHistory as LibraryHistory
    from winchkit.fleet.library.history import library_history as library_history
    from winchkit.fleet.library.index import index_library as index_library
    from winchkit.fleet.library.query import library_estimates as library_estimates
    from winchkit.fleet.library.query import library_runs as library_runs
    from winchkit.fleet.library.query import query_library as query_library

_HOME = homes(
    {
        "winchkit.fleet.diagnosis.diagnose": "diagnose_each",
        "winchkit.fleet.library.diagnose": "diagnose_library",
        "winchkit.fleet.library.history": "LibraryHistory library_history",
        "winchkit.fleet.library.index": "index_library",
        "winchkit.fleet.library.query": "library_estimates library_runs query_library",
    }
)
__all__ = list(_HOME)
__getattr__, __dir__ = lazy(globals(), _HOME)
