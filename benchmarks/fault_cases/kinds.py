"""Faults by name: how each is made, when it must stop the bench, and which causes are right."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from fault_cases.world import World

STIFFNESS = 3000.0
"""Of what a load snags on, N/m."""

Begin = Callable[[World, str], Callable[[], None] | None]
"""Makes a fault of a winch; returns what ends it."""

_COMMUNICATION = 0.15
_CELL_AGE = 0.4
"""The longest age of a reading, by the device file of the load cell, s."""
READING_DELAY = 0.03
"""From a changed reading to the supervisor: filter, conversion, poll, s."""


@dataclass(frozen=True)
class Kind:
    """A fault."""

    name: str
    begin: Begin
    causes: tuple[str, ...]
    """Kinds of trips that name it rightly; empty where nothing may trip."""
    bound: float = _COMMUNICATION
    """From the onset until every drive has left operation enabled or is in a ramp, s."""
    stops: bool = True
    """Whether the bench must stop."""
    least: float = math.inf
    """A shorter span may pass unnoticed, s; infinity is one that lasts until it is mended."""
    crosses: str = ""
    """``high`` or ``slack`` where the time counts from the moment the true tension crosses that."""
    moving: str = ""
    """``in`` or ``out`` where it can happen in that direction only, ``any`` in motion only."""
    independent: bool = False
    """Whether only the independent drive can make it."""
    real_time: bool = True
    """Whether it can be made in real time."""
    lasts: bool = False
    """Whether it goes on until it is mended, whatever span is drawn."""
    blocks: Literal["", "drive", "bus", "cell"] = ""
    """Which drives do not receive a stop in the usual way while it lasts."""
    at_rest: bool = False
    """Whether it comes after the key was released, to a winch at rest."""
    incremental: bool = False
    """Whether the encoders are incremental, homed before the motion."""
    guarded: bool = False
    """Whether node guarding is the host-loss mechanism."""
    part: str = ""
    """What recovers where a fault of it ends, from its other faults too: servo, cell, line."""


def _nothing() -> None:
    return


def _device(role: str, kind: str) -> Begin:
    def begin(world: World, winch: str) -> Callable[[], None]:
        world.live.inject(f"{winch}.{role}", kind)
        return partial(world.live.inject, f"{winch}.{role}", "recover")

    return begin


_drive = partial(_device, "servo")
_cell = partial(_device, "cell")


def _slave(kind: str, value: Any = None) -> Begin:
    """A row of ``tests/support/slave/faults.py``."""

    def begin(world: World, winch: str) -> Callable[[], None]:
        with world.live.up_to_date():
            slave = world.live.winches[winch].drive.slave  # type: ignore[attr-defined]
            slave.inject(kind, value)
        return partial(slave.mend, kind)

    return begin


def _restart(*, kept: bool) -> Begin:
    """A power cycle of an incremental encoder: its count begins at zero, or where it stood."""

    def begin(world: World, winch: str) -> Callable[[], None]:
        with world.live.up_to_date():
            slave = world.live.winches[winch].drive.slave  # type: ignore[attr-defined]
            slave.inject("counter begins anew", slave.motion.counts() if kept else 0)
            slave.inject("reboots")
        return partial(slave.mend, "counter begins anew")

    return begin


def _node(world: World, winch: str) -> int:
    return world.live.bench_spec.winch[winch].servo.node or 1


def _nmt(command: int) -> Begin:
    def begin(world: World, winch: str) -> None:
        world.inject_frame(winch, 0x000, bytes((command, _node(world, winch))))

    return begin


def _write(index: int, size: int, value: int) -> Begin:
    """A second master writes an object by SDO."""

    def begin(world: World, winch: str) -> None:
        head = {1: 0x2F, 2: 0x2B}[size]
        data = bytes((head, index & 0xFF, index >> 8, 0)) + value.to_bytes(4, "little")
        world.inject_frame(winch, 0x600 + _node(world, winch), data)

    return begin


def _lost(*bases: int, shared: tuple[int, ...] = ()) -> Begin:
    """Frames of one node (by the base of their identifiers), and shared ones, are lost."""

    def begin(world: World, winch: str) -> Callable[[], None]:
        node = _node(world, winch)
        identifiers = frozenset({base + node for base in bases} | set(shared))
        bus = world.live.bench_spec.winch[winch].servo.bus
        return world.live.wire[bus].disturb(identifiers)

    return begin


def _host_frames(world: World, winch: str) -> Callable[[], None]:
    host = world.live.bench_spec.bus["can"].node
    lost = {0x000, 0x080, 0x700 + host}
    for ref in world.live.bench_spec.winch.values():
        node = ref.servo.node or 1
        lost |= {base + node for base in (0x200, 0x300, 0x400, 0x500, 0x600)}
    return world.live.wire["can"].disturb(frozenset(lost))


def _host_heartbeat(world: World, winch: str) -> Callable[[], None]:
    host = world.live.bench_spec.bus["can"].node
    return world.live.wire["can"].disturb(frozenset({0x700 + host}))


def _cut(world: World, winch: str) -> Callable[[], None]:
    return world.live.wire["can"].disturb(range(0x800))


def _reply(change: Callable[[bytes], bytes]) -> Begin:
    """Replies of the cell's Modbus line are changed."""

    def begin(world: World, winch: str) -> Callable[[], None]:
        clock = world.simulated
        assert clock is not None, "made in simulated time only"
        clock.reply_filter = change

        def end() -> None:
            clock.reply_filter = None

        return end

    return begin


def _stall(duration: float) -> Begin:
    def begin(world: World, winch: str) -> None:
        assert world.simulated is not None, "made in simulated time only"
        world.simulated.stall(duration)

    return begin


class _Snag:
    """The load's tension changes with the cable that runs, by a stiffness, or falls to nothing."""

    def __init__(self, world: World, winch: str, stiffness: float) -> None:
        plant = world.live.winches[winch].plant
        self._world, self._plant, self._stiffness = world, plant, stiffness
        self._length, self._mass = plant.cable_length, plant.load_mass
        self._ended = False
        self._step()

    def end(self) -> None:
        """Hang the load freely again."""
        self._ended = True
        self._plant._load.mass = self._mass

    def _step(self) -> None:
        if self._ended:
            return
        wound = self._length - self._plant.cable_length
        tension = self._mass * 9.80665 + self._stiffness * wound
        with self._world.live.up_to_date():
            self._plant._load.mass = max(0.01, tension / 9.80665)
        self._world.call_at(self._world.now + 1e-3, self._step)


def _snag(stiffness: float) -> Begin:
    def begin(world: World, winch: str) -> Callable[[], None]:
        return _Snag(world, winch, stiffness).end

    return begin


def _callback(world: World, winch: str) -> None:
    def fail(_snapshot: Any) -> None:
        raise ZeroDivisionError("a user's own mistake")

    world.bench.on_cycle(fail)


def _loop_exception(world: World, winch: str) -> None:
    supervisor = world.bench.loop.supervisor
    check = supervisor.check

    def fail(*_: Any) -> Any:
        supervisor.check = check  # type: ignore[method-assign]
        raise ValueError("an exception in the control loop")

    supervisor.check = fail  # type: ignore[method-assign]


def _recorder(world: World, winch: str) -> None:
    """The disk is full from now on."""
    from winchkit.errors import FileError

    def full(*_: Any) -> None:
        raise FileError("the disk is full")

    for recorder in world.bench._recorders:
        recorder._log.write = full  # type: ignore[method-assign]


_MASTER = ("second master", "state")
_WIRES = ("nmt", "boot-up", "heartbeat", "feedback", "state", "fault", "unresponsive")
_LOST = (
    "feedback",
    "heartbeat",
    "state",
    "fault",
    "nmt",
    "slowing down",
    "deviation",
    "unresponsive",
)

_SEEN = 0.5
"""From a counter that stands still to the stop: window, response time, and a stop, s."""
_MEASURED = ("counter", "slowing down", "deviation", "runaway", "speed")


def _measurement(name: str, begin: Begin, *, stops: bool = True) -> Kind:
    """6064h or 606Ch is wrong; nothing but a motion shows it."""
    causes = (*_MEASURED, "motion at rest", "state", "position")
    return Kind(
        name,
        begin,
        causes,
        _SEEN,
        stops=stops,
        least=_SEEN,
        moving="any",
        real_time=False,
        independent=True,
        part="servo",
    )


_LYING_DRIVE = (
    _measurement("counter frozen", _slave("position stuck")),
    _measurement("counter reversed", _slave("position scaled", -1.0)),
    _measurement("counter counts double", _slave("position scaled", 2.0)),
    _measurement("velocity frozen", _slave("velocity stuck"), stops=False),
    _measurement("velocity halved", _slave("velocity scaled", 0.5)),
    _measurement("velocity reversed", _slave("velocity scaled", -1.0)),
    _measurement("TPDOs stale", _slave("tpdo stale")),
    _measurement("motor driven by its load", _slave("driven by its load")),
    Kind(
        "status lies",
        _slave("status lies"),
        ("state", "unresponsive", *_LOST),
        stops=False,
        real_time=False,
        independent=True,
        part="servo",
    ),
    Kind("mode lies", _slave("mode lies"), ("mode",), real_time=False, independent=True),
    Kind(
        "duplicate node",
        _slave("two nodes with one number"),
        (*_WIRES, "second master", "mode", "position", *_MEASURED),
        least=_COMMUNICATION,
        real_time=False,
        independent=True,
    ),
    *(
        Kind(name, _slave(name), (), stops=False, real_time=False, independent=True)
        for name in ("tpdo repeated", "rpdo repeated", "sdo refused", "sdo delayed")
    ),
)
"""From CiA 301 and 402: drives that answer, and say what is not true."""


def _own(name: str, begin: Begin, causes: tuple[str, ...], **more: Any) -> Kind:
    """A fault that the independent drive makes, which lasts until the reset sets it up again."""
    return Kind(name, begin, causes, real_time=False, independent=True, lasts=True, **more)


_FORGETFUL_DRIVE = (
    _own("counter reset", _restart(kept=False), _WIRES, least=0.0, moving="any", incremental=True),
    _own("counter reset at rest", _restart(kept=False), _WIRES, at_rest=True, incremental=True),
    _own("power cycle at rest", _restart(kept=True), _WIRES, at_rest=True, incremental=True),
    _own("set-up lost", _slave("mapping lost"), _LOST, least=0.0, moving="any", blocks="drive"),
    _own("set-up lost at rest", _slave("mapping lost"), _LOST, at_rest=True, incremental=True),
    _own("guarding replies lost", _slave("heartbeat lost"), ("heartbeat",), guarded=True),
    _own("guarding polls lost", _slave("guarding unheard"), _LOST, guarded=True),
)
"""Drives that restart or lose their set-up, and guarded ones."""


def _stale(name: str, begin: Begin, part: str) -> Kind:
    """A cell from which no reading comes; what changes replies on the line is in simulated time."""
    return Kind(
        name,
        begin,
        ("cell stale",) if part == "cell" else ("cell stale", "cell"),
        _CELL_AGE + READING_DELAY,
        least=0.5,
        real_time=part == "cell",
        blocks="cell",
        part=part,
    )


_ROWS = (
    *_LYING_DRIVE,
    *_FORGETFUL_DRIVE,
    Kind("enable input open", _drive("enable input open"), ("state",), least=0.0, part="servo"),
    Kind("second master: 6040h = 00h", _write(0x6040, 2, 0x00), _MASTER, least=0.0),
    Kind("second master: 6040h = 06h", _write(0x6040, 2, 0x06), _MASTER, least=0.0),
    Kind("second master: 6040h = 02h", _write(0x6040, 2, 0x02), _MASTER, least=0.0),
    Kind("second master: 6060h = 1", _write(0x6060, 1, 1), (*_MASTER, "mode"), least=0.0),
    Kind("stranger: NMT pre-operational", _nmt(0x80), ("second master", *_WIRES), least=0.0),
    Kind("stranger: NMT stopped", _nmt(0x02), ("second master", *_WIRES), least=0.0),
    Kind("stranger: NMT reset node", _nmt(0x81), ("second master", *_WIRES), least=0.0),
    Kind("stranger: NMT reset communication", _nmt(0x82), ("second master", *_WIRES), least=0.0),
    Kind("reboot", _drive("reboot"), _WIRES, least=0.0, part="servo"),
    Kind("RPDO 1 lost", _lost(0x200), _LOST, stops=False, blocks="drive"),
    Kind("RPDOs lost", _lost(0x200, 0x300, 0x400, 0x500), _LOST, stops=False, blocks="drive"),
    Kind("TPDOs lost", _lost(0x180, 0x280, 0x380, 0x480), _LOST, least=_COMMUNICATION),
    Kind("SYNC lost", _lost(shared=(0x080,)), _LOST, least=_COMMUNICATION, blocks="bus"),
    Kind(
        "drive's heartbeat lost", _drive("heartbeat stop"), ("heartbeat",), least=0.2, part="servo"
    ),
    Kind("host's heartbeat lost", _host_heartbeat, _LOST, least=0.2),
    Kind("host frames lost", _host_frames, _LOST, least=0.2, blocks="bus"),
    Kind("cut wire", _cut, _LOST, least=0.2, blocks="bus"),
    Kind("drive silent", _drive("silence"), _LOST, least=0.2, blocks="drive", part="servo"),
    Kind(
        "PDO mapping lost",
        _drive("map lost"),
        _LOST,
        least=0.0,
        lasts=True,
        blocks="drive",
        part="servo",
    ),
    *(
        Kind(f"drive fault: {kind}", _drive(kind), ("fault", "state"), least=0.0, part="servo")
        for kind in ("over-current", "over-temperature", "encoder", "following error")
    ),
    _stale("cell silent", _cell("silence"), "cell"),
    _stale("cell refuses", _cell("exception"), "cell"),
    Kind(
        "cell broken", _cell("sensor break"), ("cell", "cell stale"), 0.15, least=0.2, part="cell"
    ),
    Kind(
        "cell overloaded", _cell("overload"), ("cell", "cell stale"), 0.15, least=0.2, part="cell"
    ),
    Kind("cell frozen", _cell("frozen"), ("cell frozen", "frozen"), stops=False, part="cell"),
    _stale(
        "cell: wrong unit",
        _reply(lambda data: data[:6] + bytes((data[6] ^ 0x20,)) + data[7:]),
        "line",
    ),
    _stale(
        "cell: wrong transaction",
        _reply(lambda data: bytes((data[0] ^ 0x55,)) + data[1:]),
        "line",
    ),
    _stale("cell: short", _reply(lambda data: data[:-3]), "line"),
    Kind(
        "over-tension",
        _snag(STIFFNESS),
        ("tension high",),
        least=0.0,
        crosses="high",
        moving="in",
    ),
    Kind(
        "slack",
        _snag(800.0),
        ("slack",),
        0.2 + _COMMUNICATION,
        least=0.0,
        crosses="slack",
        moving="out",
    ),
    Kind("computer stalls 0.1 s", _stall(0.1), ("computer",), stops=False, real_time=False),
    Kind(
        "computer stalls 0.5 s",
        _stall(0.5),
        ("computer", "state", "fault", "feedback", "heartbeat", "nmt"),
        least=0.0,
        real_time=False,
    ),
    Kind("recorder fails", _recorder, (), stops=False),
    Kind("exception in a callback", _callback, ("failure",), least=0.0),
    Kind("exception in the loop", _loop_exception, ("loop",), least=0.0),
    Kind("released", lambda _world, _winch: None, (), stops=False),
)

KINDS: dict[str, Kind] = {row.name: row for row in _ROWS}
