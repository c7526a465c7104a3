"""What the core looks up of fleets."""

from __future__ import annotations

from winchkit.wings import Wing

WING = Wing(
    parts={
        "compare_command": "winchkit.fleet.cli.each:tell_comparisons",
        "diagnose_command": "winchkit.fleet.cli.each:tell_diagnoses",
    },
    commands={
        "Model and runs": {
            "fleet": ("winchkit.fleet.cli.fleet", "Many winches: diagnose a library of runs.")
        },
        "Files and simulation": {
            "library": (
                "winchkit.fleet.cli.library",
                "Tables of the runs of a folder: index, list, query.",
            )
        },
    },
    views=("winchkit.fleet.web.view:LibraryView",),
)
