"""Description of a drive by its EDS or DCF: modes, PDOs, host-loss mechanisms, option codes.

An EDS declares objects; whether the drive acts on them is proved at commissioning only.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from canopen.objectdictionary import datatypes

from winchkit.drivers.can.canopen.declared import (
    configured_value,
    declared,
    fixed_mapping,
    mapped_objects,
    unmappable,
    writable,
)
from winchkit.drivers.can.canopen.identity import SERVO_PROFILE, Identity
from winchkit.drivers.can.canopen.node import object_name
from winchkit.drivers.can.canopen.pdo_parameters import MOST_PDOS
from winchkit.drivers.can.cia402.modes import MODES, modes_of
from winchkit.drivers.can.cia402.option_codes import OPTIONS

_NEEDED = {
    "PP": (0x607A, 0x6081, 0x6083),
    "PV": (0x60FF,),
    "PT": (0x6071,),
    "HM": (0x6098, 0x6099),
    "IP": (0x60C1, 0x60C2),
    "CSP": (0x607A,),
    "CSV": (0x60FF,),
    "CST": (0x6071,),
}
"""Objects without which a drive cannot have a mode."""
ALWAYS = (0x6040, 0x6041, 0x6060, 0x6061, 0x6064, 0x606C)
"""Objects without which winchkit moves no drive."""
_MOTION = ("CSV", "CSP", "PV", "IP")
_FEEDBACK = (0x6041, 0x6064, 0x606C, 0x6077, 0x6061, 0x603F)
_CONTROL = 0x6040
"""Control word, the one of these that the host sends."""
_CARRIED = (_CONTROL, 0x6041, 0x6064, 0x606C)
"""Objects without which in a PDO winchkit moves no drive."""
_RPDO, _TPDO, _MAPPING = 0x1400, 0x1800, 0x200
_FIRST_PDOS, PDO_BITS = 4, 64
"""PDOs with a predefined COB-ID, and bits of eight data bytes (CiA 301)."""
_OWN, _VALUES = 0x6000, range(0x2000, 0xA000)
"""Below 6000h objects are the maker's own (CiA 301)."""
_FURTHER_AXES = range(0x6840, 0xA000, 0x800)
"""Control words of the logical devices 2 to 8 (CiA 402-1)."""
_UNSIGNED_WHERE_SIGNED = (0x6064, 0x606C, 0x607A, 0x60FF, 0x6071, 0x6077)
"""Signed objects of CiA 402-2 that some makers declare unsigned."""


@dataclass(frozen=True)
class PdoEntry:
    """A PDO that the EDS declares."""

    number: int
    fixed: bool
    """Whether its mapping cannot be changed."""
    objects: tuple[str, ...]
    """Its mapping by default, e.g. ``0x6041``; empty where the EDS does not say."""


@dataclass(frozen=True)
class OptionEntry:
    """An option code that the EDS declares."""

    index: str
    occasion: str
    writable: bool
    default: int | None
    meaning: str


@dataclass(frozen=True)
class HostLossObjects:
    """A mechanism by which a drive detects a lost host, by the objects of its EDS."""

    way: str
    """As ``host_loss`` in a device file: heartbeat, guarding, rpdo-timeout, sync-loss."""
    objects: tuple[str, ...]
    reaction: str
    """Reaction of the drive, as far as the EDS declares it."""


@dataclass(frozen=True)
class DriveDescription:
    """Content of an EDS that matters for moving the drive."""

    maker: str
    product: str
    identity: Identity
    device_profile: int | None
    """Lower half of 1000h, 402 for drives; None where the EDS does not say."""
    servo_drive: bool
    """Whether it is described as one: 1000h says 402, or 6040h and 6041h are there."""
    values: tuple[str, ...]
    """Of a device that is no drive: objects that a TPDO can carry, the maker's own last."""
    modes: tuple[str, ...]
    """Modes whose objects the EDS has."""
    motion_modes: tuple[str, ...]
    """Those of them that the bench can move it in."""
    feedback: dict[str, bool]
    """Objects of the feedback by index: whether a TPDO can carry them."""
    targets: dict[str, bool]
    """Targets and control word: whether an RPDO can carry them."""
    receive: tuple[PdoEntry, ...]
    transmit: tuple[PdoEntry, ...]
    host_loss: tuple[HostLossObjects, ...]
    options: tuple[OptionEntry, ...]
    obstacles: tuple[str, ...]
    """Why winchkit cannot move it; none where it can."""
    differences: tuple[str, ...]
    """What is unusual, and what winchkit does about it."""


def describe(dictionary: Any) -> DriveDescription:
    """Describe a drive by canopen's dictionary of its EDS."""
    info = dictionary.device_information
    modes = tuple(_modes(dictionary))
    servo_drive = _is_drive(dictionary)
    receive, transmit = (tuple(_pdos(dictionary, first)) for first in (_RPDO, _TPDO))
    targets = {MODES[mode].target for mode in modes} - {None}
    ways = host_loss_ways(dictionary)
    motion = {mode: _target_obstacle(dictionary, mode) for mode in _MOTION if mode in modes}
    return DriveDescription(
        maker=info.vendor_name or "",
        product=info.product_name or "",
        identity=Identity(
            info.vendor_number or 0, info.product_number or 0, info.revision_number or 0
        ),
        device_profile=_profile(dictionary),
        servo_drive=servo_drive,
        values=() if servo_drive else tuple(_values(dictionary)),
        modes=modes,
        motion_modes=tuple(mode for mode, reason in motion.items() if not reason),
        feedback=_carried(dictionary, [(index, 0) for index in _FEEDBACK], receive=False),
        targets=_carried(dictionary, [(0x6040, 0), *sorted(filter(None, targets))], receive=True),
        receive=receive,
        transmit=transmit,
        host_loss=ways,
        options=tuple(_options(dictionary)),
        obstacles=tuple(_obstacles(dictionary, motion, receive, transmit, ways)),
        differences=tuple(_differences(dictionary, motion, receive, transmit)),
    )


def _profile(dictionary: Any) -> int | None:
    kind = configured_value(declared(dictionary, 0x1000))
    return None if not kind else kind & 0xFFFF


def _is_drive(dictionary: Any) -> bool:
    """Whether the objects are a drive's; some makers write another device profile into 1000h."""
    return _profile(dictionary) == SERVO_PROFILE or (0x6040 in dictionary and 0x6041 in dictionary)


def _values(dictionary: Any) -> Iterator[str]:
    """Objects of the device profile, then the maker's, that a TPDO can carry; reals among them."""
    for index in sorted(
        filter(_VALUES.__contains__, dictionary), key=lambda one: (one < _OWN, one)
    ):
        found = dictionary[index]
        subs = sorted(set(getattr(found, "subindices", ())) - {0}) or [0]
        for sub in subs:
            variable = declared(dictionary, index, sub)
            if (
                variable is not None
                and variable.pdo_mappable
                and variable.access_type not in ("wo", "rww")
            ):
                yield object_name(index, sub)


def host_loss_ways(dictionary: Any) -> tuple[HostLossObjects, ...]:
    """Mechanisms by which the drive may detect a lost host, best first; each needs its proof."""
    return tuple(_host_loss(dictionary))


def _host_loss(dictionary: Any) -> Iterator[HostLossObjects]:
    reaction, by = _reaction(dictionary)
    if writable(dictionary, 0x1016, 1):
        yield HostLossObjects("heartbeat", ("1016h", *by), reaction)
    if writable(dictionary, 0x100C) and writable(dictionary, 0x100D):
        yield HostLossObjects("guarding", ("100Ch", "100Dh", *by), reaction)
    timers = [
        entry.number
        for entry in _pdos(dictionary, _RPDO)
        if writable(dictionary, _RPDO + entry.number - 1, 5)
    ]
    if timers:
        records = tuple(f"{_RPDO + number - 1:04X}h:5" for number in timers[:1])
        yield HostLossObjects(
            "rpdo-timeout", records, "EMCY 8250h; commissioning shows what else it does"
        )
    cyclic = any(MODES[mode].cyclic for mode in _modes(dictionary))
    if cyclic and writable(dictionary, 0x1006):
        yield HostLossObjects("sync-loss", ("1006h",), "commissioning shows what it does")


def _reaction(dictionary: Any) -> tuple[str, tuple[str, ...]]:
    """Reaction to a missing heartbeat or guarding poll, and the object that declares it."""
    lost = declared(dictionary, 0x6007)
    if lost is not None:
        row = OPTIONS["connection_lost"]
        if lost.writable:
            return "it reacts as set in 6007h (3 quick stop, 1 fault)", ("6007h",)
        words = row.meanings.get(lost.default or 0, "of the maker's own")
        return f"it reacts as fixed in 6007h: {lost.default} ({words})", ("6007h",)
    if declared(dictionary, 0x1029, 1) is not None:
        return (
            "it leaves the state operational (1029h:1), and there is no 6007h: commissioning shows "
            "whether the motor stops then"
        ), ("1029h:1",)
    return "neither 6007h nor 1029h: commissioning shows what it does", ()


def _modes(dictionary: Any) -> Iterator[str]:
    """Modes that the EDS lets the drive have and 6502h does not deny."""
    supported = declared(dictionary, 0x6502)
    claimed = (
        modes_of(supported.default)
        if supported is not None and supported.default
        else tuple(_NEEDED)
    )
    for mode in _NEEDED:
        if mode in claimed and not any(lacking(dictionary, mode)):
            yield mode


def lacking(dictionary: Any, mode: str) -> Iterator[str]:
    """Why a drive cannot have a mode by its EDS: its objects, or the range of 6060h."""
    for index in _NEEDED[mode]:
        if index not in dictionary:
            yield f"{mode} needs {index:04X}h, which the EDS lacks"
    selection, number = declared(dictionary, 0x6060), MODES[mode].number
    least, largest = getattr(selection, "min", None), getattr(selection, "max", None)
    if least is not None and largest is not None and not least <= number <= largest:
        yield f"{mode} is {number} in 6060h, which the EDS limits to {least} to {largest}"


def _target_obstacle(dictionary: Any, mode: str) -> str:
    """Why no RPDO can carry the target of a mode; empty where one can."""
    target = MODES[mode].target
    assert target is not None, "a mode of motion has a target"
    variable = declared(dictionary, *target)
    reason = "the EDS lacks it" if variable is None else unmappable(variable, receive=True)
    return reason and f"no RPDO can carry {object_name(*target)}: {reason}"


def _pdos(dictionary: Any, first: int) -> Iterator[PdoEntry]:
    for number in range(1, MOST_PDOS + 1):
        if first + number - 1 in dictionary:
            fixed = fixed_mapping(dictionary, first == _RPDO, number)
            mapping = first + _MAPPING + number - 1
            yield PdoEntry(number, fixed is not None, mapped_objects(dictionary, mapping))


def _carried(dictionary: Any, keys: list[tuple[int, int]], *, receive: bool) -> dict[str, bool]:
    found = {}
    for key in keys:
        variable = declared(dictionary, *key)
        able = variable is not None and not unmappable(variable, receive=receive)
        found[object_name(*key)] = able
    return found


def _options(dictionary: Any) -> Iterator[OptionEntry]:
    for row in OPTIONS.values():
        variable = declared(dictionary, row.index)
        if variable is not None:
            value = configured_value(variable)
            meaning = "" if value is None else row.meanings.get(value, "of the maker's own")
            yield OptionEntry(
                f"{row.index:04X}h", row.occasion, bool(variable.writable), value, meaning
            )


def _obstacles(
    dictionary: Any,
    motion: dict[str, str],
    receive: tuple[PdoEntry, ...],
    transmit: tuple[PdoEntry, ...],
    ways: tuple[HostLossObjects, ...],
) -> Iterator[str]:
    if not _is_drive(dictionary):
        profile = _profile(dictionary)
        stated = "no device profile" if profile is None else f"device profile {profile}, not 402"
        yield f"it is no servo drive: 1000h says {stated}, and 6040h and 6041h are not both there"
        return
    for index in ALWAYS:
        if index not in dictionary:
            yield f"the EDS lacks {index:04X}h, which every motion needs"
        elif index in _CARRIED and (
            reason := unmappable(declared(dictionary, index), receive=index == _CONTROL)
        ):
            kind = "RPDO" if index == _CONTROL else "TPDO"
            yield f"no {kind} can carry {index:04X}h: {reason}"
    if not motion:
        yield f"none of the modes {', '.join(_MOTION)} is there"
    elif all(motion.values()):
        yield f"it has {', '.join(motion)}, but {'; '.join(dict.fromkeys(motion.values()))}"
    targets = [
        (_CONTROL, 0),
        *(MODES[mode].target for mode, reason in motion.items() if not reason),
    ]
    for kind, entries, wanted in (
        ("receive", receive, [[targets[0], target] for target in targets[1:]]),
        ("transmit", transmit, [[(index, 0) for index in _CARRIED if index != _CONTROL]]),
    ):
        if not any(entry.number <= _FIRST_PDOS for entry in entries):
            yield f"the EDS declares no {kind} PDO (1 to 4)"
        elif (missing := [_no_room(dictionary, entries, keys) for keys in wanted]) and all(missing):
            yield f"the {kind} PDOs 1 to 4 have no room for {missing[0]}"
    if not ways:
        yield (
            "the EDS has no way to notice a dead host (1016h, 100Ch with 100Dh, 1400h:5, 1006h); "
            "a maker's own, or the hardware that stops the drive, is to be declared as host_loss"
        )


def _no_room(dictionary: Any, entries: tuple[PdoEntry, ...], keys: list[Any]) -> str:
    """Object that no PDO has room for beside the others; empty where all have room."""
    first = [entry for entry in entries if entry.number <= _FIRST_PDOS]
    held = {name for entry in first if entry.fixed for name in entry.objects}
    free = [PDO_BITS for entry in first if not entry.fixed]
    for index, sub in keys:
        variable = declared(dictionary, index, sub)
        if variable is None or (f"0x{index:04X}:{sub}" if sub else f"0x{index:04X}") in held:
            continue
        bits = len(variable)
        place = next((number for number, room in enumerate(free) if room >= bits), None)
        if place is None:
            others = ", ".join(object_name(*key) for key in keys if key != (index, sub))
            return f"{object_name(index, sub)} ({bits} bits) beside {others}"
        free[place] -= bits
    return ""


def _differences(
    dictionary: Any,
    motion: dict[str, str],
    receive: tuple[PdoEntry, ...],
    transmit: tuple[PdoEntry, ...],
) -> Iterator[str]:
    yield from _kind_differences(dictionary)
    for mode, reason in motion.items():
        if reason:
            yield f"winchkit does not move it in {mode}: {reason}"
    for index in _UNSIGNED_WHERE_SIGNED:
        variable = declared(dictionary, index)
        if variable is not None and variable.data_type in datatypes.UNSIGNED_TYPES:
            yield (
                f"{index:04X}h is declared unsigned; CiA 402 makes it signed: it is read and "
                "written as two's complement of its size"
            )
    error = declared(dictionary, 0x603F)
    if error is not None and unmappable(error, receive=False):
        yield "603Fh (error code) cannot be mapped: leave it out of the TPDOs, EMCY reports it"
    if 0x607C not in dictionary:
        yield (
            "607Ch (home offset) is missing: name the maker's own object as home_offset in the "
            "device file; else `winchkit home --here` keeps the zero in the record of positions"
        )
    consumer = declared(dictionary, 0x1016, 1)
    if consumer is not None and consumer.max is not None and consumer.max < 1 << 16:
        yield (
            f"1016h:1 is limited to {consumer.max} in the EDS, in which no node number fits "
            "(node << 16): the EDS is wrong, or the drive has no such watchdog; its proof decides"
        )
    if 0x6502 not in dictionary:
        yield "6502h (supported modes) is missing: the modes of the device file count"
    elif not configured_value(declared(dictionary, 0x6502)):
        yield (
            "6502h (supported modes) has no value in the EDS: modes are those whose objects are "
            "there, `winchkit info` reads the drive's"
        )
    yield from _pdo_differences(receive, transmit)
    if (sync := configured_value(declared(dictionary, 0x1005)) or 0) & 1 << 30:
        yield f"1005h is {sync:X}h: the drive produces SYNC itself, which is switched off"
    if dictionary.device_information.vendor_number in (None, 0):
        yield "the vendor number is missing: the drive cannot be recognised by its identity"


def _kind_differences(dictionary: Any) -> Iterator[str]:
    """Another device profile, and axes beside the first."""
    profile = _profile(dictionary)
    if profile not in (None, SERVO_PROFILE):
        yield (
            f"1000h says device profile {profile}, not 402; 6040h and 6041h are there, so it is "
            "described as a drive of CiA 402"
        )
    if axes := [first for first in _FURTHER_AXES if first in dictionary]:
        others = ", ".join(f"{index:04X}h" for index in axes)
        yield f"control words of further axes at {others}: winchkit moves the axis of 6040h only"


def _pdo_differences(
    receive: tuple[PdoEntry, ...], transmit: tuple[PdoEntry, ...]
) -> Iterator[str]:
    for name, entries in (("RPDO", receive), ("TPDO", transmit)):
        for entry in entries:
            if entry.fixed and entry.number <= 4:
                held = ", ".join(entry.objects) or "nothing"
                yield f"{name} {entry.number} has a fixed mapping: {held}"
        if beyond := [entry.number for entry in entries if entry.number > 4]:
            yield f"{name} {', '.join(map(str, beyond))} beyond the first four: switched off"
