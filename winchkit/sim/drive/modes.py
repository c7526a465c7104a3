"""The simulated modes of operation of CiA 402."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum

from winchkit.errors import FileError
from winchkit.sim.drive.object_dictionary import ObjectDictionary


class Mode(IntEnum):
    """Values of 6060h; the value less one is the mode's bit in 6502h."""

    NONE = 0
    PP = 1
    PV = 3
    PT = 4
    HM = 6
    IP = 7
    CSP = 8
    CSV = 9
    CST = 10


_ALWAYS = ((0x6040, 0), (0x6041, 0), (0x6060, 0), (0x6061, 0), (0x6064, 0))
_NEEDED = {
    Mode.PP: ((0x607A, 0), (0x6081, 0)),
    Mode.PV: ((0x60FF, 0),),
    Mode.PT: ((0x6071, 0),),
    Mode.HM: ((0x6098, 0), (0x6099, 1), (0x6099, 2)),
    Mode.IP: ((0x60C1, 1),),
    Mode.CSP: ((0x607A, 0),),
    Mode.CSV: ((0x60FF, 0),),
    Mode.CST: ((0x6071, 0),),
}


def modes_of(names: Iterable[str]) -> frozenset[Mode]:
    """Modes of a device file's list."""
    return frozenset(Mode[name] for name in names)


def supported(modes: Iterable[Mode]) -> int:
    """Value of 6502h for the modes of a drive."""
    return sum(1 << (mode - 1) for mode in modes if mode)


def check_objects(objects: ObjectDictionary, modes: Iterable[Mode], node: int) -> None:
    """Raise FileError where an EDS lacks an object that these modes need."""
    wanted = dict.fromkeys(_ALWAYS, "every drive")
    wanted |= {key: f"the mode {mode.name}" for mode in modes for key in _NEEDED[mode]}
    lacking = [(key, what) for key, what in wanted.items() if key not in objects]
    if lacking:
        words = ", ".join(f"{index:04X}h:{sub} ({what})" for (index, sub), what in sorted(lacking))
        raise FileError(
            f"simulated drive, node {node}: its EDS lacks {words}; complete it, or take the mode "
            "out of the device file"
        )
