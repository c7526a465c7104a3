"""Option codes of CiA 402-2: reaction to stops, faults and a lost host (605Ah to 605Eh, 6007h)."""

from __future__ import annotations

from dataclasses import dataclass, fields

from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.errors import NotPermitted
from winchkit.schema.devices.servo import OptionSpec

_RAMPS = {
    1: "slow down on the deceleration ramp",
    2: "slow down on the quick-stop ramp",
    3: "slow down at the current limit",
    4: "slow down at the voltage limit",
}
_COAST = {0: "coast"}
_STAY = {code + 4: f"{words} and stay in quick stop" for code, words in _RAMPS.items()}


@dataclass(frozen=True)
class OptionCode:
    """An option code of a drive."""

    index: int
    occasion: str
    """When it counts."""
    value: int | None
    """None where the drive has no such object."""
    meaning: str

    def __str__(self) -> str:
        return f"{self.index:04X}h {self.occasion}: {self.value} ({self.meaning})"


@dataclass(frozen=True)
class _OptionCode:
    index: int
    occasion: str
    meanings: dict[int, str]


OPTIONS: dict[str, _OptionCode] = {
    "quick_stop": _OptionCode(0x605A, "quick stop", _COAST | _RAMPS | _STAY),
    "shutdown": _OptionCode(0x605B, "shutdown", _COAST | {1: _RAMPS[1]}),
    "disable_operation": _OptionCode(0x605C, "disable operation", _COAST | {1: _RAMPS[1]}),
    "halt": _OptionCode(0x605D, "halt", _COAST | _RAMPS),
    "fault": _OptionCode(0x605E, "fault", _COAST | _RAMPS),
    "connection_lost": _OptionCode(
        0x6007,
        "loss of the host",
        {0: "nothing", 1: "fault", 2: "disable voltage: coast", 3: "quick stop"},
    ),
}
"""By the keys of a device file."""

_LOST = "connection_lost"
BY_6007 = ("heartbeat", "guarding")
"""Mechanisms by which a drive notices a dead host and then does what 6007h says."""
_UNKNOWN = "the maker's own: see the drive's manual"


def merged(device: OptionSpec, bench: OptionSpec) -> OptionSpec:
    """The device file's options, with the bench's own before them."""
    chosen = {}
    for item in fields(OptionSpec):
        own = getattr(bench, item.name)
        chosen[item.name] = getattr(device, item.name) if own is None else own
    return OptionSpec(**chosen)


def read_options(node: SdoNode) -> dict[str, OptionCode]:
    """The codes as the drive has them; raises NoReply, DeviceRefused."""
    return {key: _option(row, node.read_if_there(row.index)) for key, row in OPTIONS.items()}


def set_options(
    node: SdoNode, wanted: OptionSpec, brake: bool, host_loss: str | None = "heartbeat"
) -> dict[str, OptionCode]:
    """Write what is configured, read everything back, refuse what would drop a load.

    ``host_loss`` is the mechanism by which it notices a dead host, None for none. Raises
    NotPermitted, NoReply, DeviceRefused.
    """
    for key, row in OPTIONS.items():
        value = getattr(wanted, key)
        if value is not None and node.read_if_there(row.index) != value:
            node.write_verified(row.index, 0, value)
    options = read_options(node)
    if host_loss in BY_6007:
        _check_lost(node, options[_LOST])
    _check_quick_stop(node, options["quick_stop"])
    if not brake:
        _check_coasting(node, options)
    return options


def _option(row: _OptionCode, value: int | None) -> OptionCode:
    meaning = "absent" if value is None else row.meanings.get(value, _UNKNOWN)
    return OptionCode(row.index, row.occasion, value, meaning)


def _check_lost(node: SdoNode, lost: OptionCode) -> None:
    if lost.value in (None, 1, 2, 3):
        # Without a 6007h what an enabled drive does is for the commissioning to see.
        return
    raise NotPermitted(
        f"{node.place(lost.index)} is {lost.value}: the drive would go on moving when the host "
        "dies; set it to 3 (quick stop) or 1 (fault), in the drive or as "
        "servo.options.connection_lost in its device file"
    )


def _check_quick_stop(node: SdoNode, quick_stop: OptionCode) -> None:
    """A code beyond the standard's may mean that quick stop does nothing: no brake mends that."""
    if quick_stop.meaning == _UNKNOWN:
        raise NotPermitted(
            f"{node.place(quick_stop.index)} is {quick_stop.value}, a code that is not one of the "
            "standard's (0 to 8): the drive may ignore a quick stop, which every stop relies on; "
            "set it to 2 or 6 (ramp), in the drive or as servo.options.quick_stop in its device "
            "file"
        )


def _check_coasting(node: SdoNode, options: dict[str, OptionCode]) -> None:
    for key, item in options.items():
        coasts = 2 if key == _LOST else 0
        if item.value is None or (item.value != coasts and item.meaning != _UNKNOWN):
            continue
        verb = "coasts" if item.value == coasts else "may coast (the maker's own code)"
        raise NotPermitted(
            f"{node.place(item.index)} is {item.value}: on {item.occasion} the motor {verb} and a "
            f"hanging load falls; set a ramp, in the drive or as servo.options.{key} in its "
            "device file, or declare `brake = true` where a brake holds the load"
        )
