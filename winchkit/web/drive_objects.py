"""Objects of a winch's drive for the Bench view, read where the winch is disabled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from winchkit.bench.control.snapshot import Phase
from winchkit.bench.drives.node_access import drive_at
from winchkit.drivers.can.tools.info import DriveInfo, read_info
from winchkit.errors import UsageError
from winchkit.schema.bench import BenchSpec

__all__ = ["drive_objects"]


def drive_objects(spec: BenchSpec, status: Mapping[str, Any], winch: str) -> dict[str, Any]:
    """What ``winchkit info`` shows of a drive, in groups.

    Parameters
    ----------
    spec : BenchSpec
        The bench.
    status : mapping
        Its newest status.
    winch : str
        Name of the winch.

    Returns
    -------
    dict
        ``groups``: name, and rows of object, meaning and value.

    Raises
    ------
    UsageError
        For an unknown winch, and where it is not disabled.
    """
    if winch not in spec.winch:
        raise UsageError(f"there is no winch '{winch}'; there are {', '.join(spec.winch)}")
    phase = status.get("winch", {}).get(winch, {}).get("phase", "unknown")
    if phase != Phase.DISABLED.value:
        raise UsageError(f"winch {winch} is {phase}; its objects are read where it is disabled")
    with drive_at(spec, winch) as node:
        return {"winch": winch, "groups": _groups(node.node, read_info(node.objects))}


def _groups(node: int, info: DriveInfo) -> list[dict[str, Any]]:
    register = info.error_register
    own = [
        ("1008h", "name", " ".join(filter(None, (info.name, info.hardware, info.software)))),
        ("1018h", "identity", str(info.identity)),
        ("1001h", "error register", "–" if register is None else f"{register:02X}h"),
        ("6041h", "state", info.state),
        ("6061h", "mode", info.mode),
        ("6502h", "modes", ", ".join(info.modes) or "–"),
    ]
    errors = [("1003h", words, f"{code:04X}h") for code, words in info.errors]
    groups: dict[str, list[tuple[str, str, Any]]] = {f"node {node}": own, "errors": errors}
    for group, entries in info.noted.items():
        groups[group] = [
            (
                f"{item.index:04X}h" + (f":{item.sub}" if item.sub else ""),
                f"{item.what}{item.meaning and ': '}{item.meaning}",
                item.value,
            )
            for item in entries
            if item.value is not None
        ]
    return [{"name": name, "rows": rows} for name, rows in groups.items() if rows]
