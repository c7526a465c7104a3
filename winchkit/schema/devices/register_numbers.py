"""Numbers of registers in a manual (40008) as addresses on the line (7).

Of a number of five or six digits the first one is the kind: 4 holding registers, which function 3
reads, and 3 input registers, of function 4; the rest counts from 1 (Modicon's notation).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from winchkit.schema.reading.lines import Key

FUNCTIONS = {4: 3, 3: 4}
"""Modbus function that reads the registers of a leading digit."""
_KEYS = ("register", "status_register")
_BLOCKS = ("read", "status_read")
_MOST = {10_000: 9_999, 100_000: 65_536}
"""Value of the leading digit of each notation, and how many registers it can number."""

FaultAt = Callable[[Key, str], None]


def address_of(number: int) -> tuple[int, int] | None:
    """Address and reading function of a register's number; None for another number."""
    for unit, most in _MOST.items():
        kind, count = divmod(number, unit)
        if kind in FUNCTIONS and 1 <= count <= most:
            return count - 1, FUNCTIONS[kind]
    return None


def with_addresses(tree: Mapping[str, Any], fault: FaultAt) -> Mapping[str, Any]:
    """The table ``[modbus]`` with addresses, where its blocks have ``register``, not ``start``."""
    blocks = {key: tree[key] for key in _BLOCKS if isinstance(tree.get(key), Mapping)}
    numbered = [key for key, block in blocks.items() if "register" in block]
    if not numbered:
        return tree
    for key, block in blocks.items():
        if "start" in block:
            message = "is an address beside numbers of the manual; write `register` in all blocks"
            fault(("modbus", key, "start"), message)
    converted: Mapping[str, Any] = _converted(tree, ("modbus",), fault)
    return converted


def _converted(value: Any, place: Key, fault: FaultAt) -> Any:
    if isinstance(value, list | tuple):
        return [_converted(item, (*place, number), fault) for number, item in enumerate(value)]
    if not isinstance(value, Mapping):
        return value
    is_block = len(place) == 2 and place[1] in _BLOCKS
    found: dict[str, Any] = {}
    for key, item in value.items():
        if key not in _KEYS:
            found[key] = _converted(item, (*place, key), fault)
            continue
        read = address_of(item) if isinstance(item, int) else None
        if read is None:
            fault(
                (*place, key),
                f"{item!r} is no register's number (40001 to 49999, 30001 to 39999, or six "
                "digits), and [modbus.read] gives one; addresses need `start` there",
            )
            read = 0, value.get("function", 3)
        address, function = read
        found["start" if is_block else key] = address
        if is_block:
            found["function"] = function
            if value.get("function", function) != function:
                fault((*place, "function"), f"register {item} is read by function {function}")
        elif "command" in place and function != FUNCTIONS[4]:
            fault((*place, key), f"register {item} cannot be written; those of 4xxxx can")
    return found
