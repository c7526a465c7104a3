"""Types that the public functions of fleets return, for annotations.

Each is imported when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from winchkit.wings import homes, lazy

if TYPE_CHECKING:
    from winchkit.fleet.diagnosis.history import FleetHistory as FleetHistory
    from winchkit.fleet.diagnosis.swapped_profiles import Swap as Swap
    from winchkit.fleet.library.diagnose import FleetReport as FleetReport
    from winchkit.fleet.library.index import IndexReport as IndexReport

_HOME = homes(
    {
        "winchkit.fleet.diagnosis.history": "FleetHistory",
        "winchkit.fleet.diagnosis.swapped_profiles": "Swap",
        "winchkit.fleet.library.diagnose": "FleetReport",
        "winchkit.fleet.library.index": "IndexReport",
    }
)
__all__ = list(_HOME)
__getattr__, __dir__ = lazy(globals(), _HOME)
