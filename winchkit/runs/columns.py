"""Names and dimensions of the columns of a run, and the reader of a header."""

from __future__ import annotations

import re
from difflib import get_close_matches

from winchkit.errors import suggest
from winchkit.schema.mapping import CHANNEL_DIMENSIONS, POSE_DIMENSIONS, POSITION, QUATERNION
from winchkit.units import GRAVITY, UNITS, dimension_of

_TRACKER_DIMENSIONS: dict[str, str] = {
    name.replace("platform", "tracker"): POSE_DIMENSIONS[name] for name in (*POSITION, *QUATERNION)
}
"""The same in the tracker's frame, as it was received."""

_HEADER = re.compile(r"\s*([^\[\]]*?)\s*(?:\[\s*([^\[\]]*?)\s*\])?\s*")


def header_of(text: str) -> tuple[str, str] | None:
    """Name and unit of a header cell ``name [unit]``; None where it is neither."""
    found = _HEADER.fullmatch(text)
    return (found[1], found[2] or "") if found and found[1] else None


def column_dimension(name: str) -> str | None:
    """Dimension of a column, with or without a winch's prefix; None for an unknown one."""
    if name == "time":
        return "time"
    pose = POSE_DIMENSIONS.get(name) or _TRACKER_DIMENSIONS.get(name)
    return pose or CHANNEL_DIMENSIONS.get(name.rpartition(".")[2])


def near_miss(name: str) -> str | None:
    """A known name that is similar to an unknown one."""
    known = ["time", *CHANNEL_DIMENSIONS, *POSE_DIMENSIONS, *_TRACKER_DIMENSIONS]
    return next(iter(get_close_matches(name.rpartition(".")[2], known, n=1, cutoff=0.75)), None)


def unit_fault(name: str, unit: str, dimension: str) -> str | None:
    """Message on a unit of the wrong dimension; None for a valid one."""
    units = UNITS[dimension]
    if unit in units or (dimension == "ratio" and not unit):
        return None
    known = f"use one of {', '.join(units)}"
    if not unit:
        return f"column '{name}' has no unit; write '{name} [{next(iter(units))}]'"
    other = dimension_of(unit)
    if dimension == "force" and other == "mass":
        return (
            f"column '{name}' is in [{unit}], a mass, and a force is needed: multiply by "
            f"g = {GRAVITY} m/s^2 and write [N]; a known weight goes into the metadata, "
            "# load_mass: 15 kg"
        )
    if other is not None:
        return f"column '{name}' is in [{unit}], a unit of {other}, not of {dimension}; {known}"
    return f"column '{name}' has the unknown unit [{unit}]; {known}" + suggest(unit, list(units))
