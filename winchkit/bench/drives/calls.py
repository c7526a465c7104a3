"""The commands for drives as functions, one call each.

``bench`` is a bench file, its contents, or a bus alone (:func:`can_bus`); ``who`` is a winch or a
node number, by default the only winch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any

from winchkit.arguments import path_of
from winchkit.bench.cells.instruments import device_of, eds_of
from winchkit.bench.drives.node_access import bus_only, drive_at, free_bus, nodes_on
from winchkit.drivers.can.bus.load import BusLoad, FrameKind, load_of
from winchkit.drivers.can.canopen.identity import Identity
from winchkit.drivers.can.canopen.lss import UNCONFIGURED, LssLine
from winchkit.drivers.can.canopen.node import read_dictionary
from winchkit.drivers.can.canopen.pdo import parse_object
from winchkit.drivers.can.cia402.modes import MODES
from winchkit.drivers.can.tools.config import (
    Difference,
    difference,
    fitting_config,
    read_config,
    restore,
    store,
    write_config,
    write_config_file,
)
from winchkit.drivers.can.tools.info import DriveInfo, read_info
from winchkit.drivers.can.tools.scan import ScannedNode
from winchkit.errors import Fault, FileError, UsageError
from winchkit.regular_file import refuse_existing
from winchkit.schema.bench import BenchSpec, WinchWiring
from winchkit.schema.devices.servo import PdoSpec
from winchkit.schema.read import read_bench

_COMMANDS = {(0x6040, 0), (0x6060, 0), (0x60B1, 0), (0x60B2, 0)}
"""Control word, mode and offsets: an RPDO with one of them, or the mode's target, is sent."""


def _frames(
    spec: BenchSpec, name: str, winch: WinchWiring, read: Callable[[Path, int], Any]
) -> Iterator[FrameKind]:
    """PDOs of one drive: all that it sends, and those of the host that carry commands."""
    device = device_of(spec, winch.servo)
    if device.servo is None:
        raise FileError(Fault(f"winch {name}: '{winch.servo.device}' is no servo", spec.path))
    servo = device.servo
    dictionary = read(eds_of(device), 1)
    for pdo in servo.tpdo:
        size = _size(dictionary, pdo, device.path)
        yield _sent_by_drive(f"{name} TPDO {pdo.number}", size, pdo)
    live = _COMMANDS | {MODES[servo.motion_mode].target}
    for pdo in servo.rpdo:
        if live & {parse_object(text) for text in pdo.objects}:
            size = _size(dictionary, pdo, device.path)
            yield FrameKind(f"{name} RPDO {pdo.number}", size, every=1)


def _sent_by_drive(name: str, size: int, pdo: PdoSpec) -> FrameKind:
    """Worst case: events come as often as the inhibit time lets them, else with every SYNC."""
    if pdo.by_event and pdo.inhibit_time:
        return FrameKind(name, size, period=pdo.inhibit_time)
    return FrameKind(name, size, every=1 if pdo.by_event else max(1, pdo.transmission))


def _size(dictionary: Any, pdo: PdoSpec, path: str) -> int:
    """Data bytes of a PDO."""
    bits = 0
    for text in pdo.objects:
        variable = dictionary.get_variable(*parse_object(text))
        if variable is None:
            raise FileError(Fault(f"{text} is not in its EDS", path, key=f"PDO {pdo.number}"))
        bits += len(variable)
    return (bits + 7) // 8


Wiring = str | Path | BenchSpec


def can_bus(
    interface: str, channel: str, bitrate: int = 1_000_000, port: int | None = None
) -> BenchSpec:
    """Return the wiring of one CAN bus, for the other functions in place of a bench file.

    Parameters
    ----------
    interface, channel : str
        Of python-can, such as ``socketcan`` and ``can0``.
    bitrate : int
        bit/s.
    port : int, optional
        UDP port of the interface ``udp_multicast``.

    Returns
    -------
    BenchSpec
        A bench without winches.
    """
    return bus_only(interface, channel, bitrate, port)


def scan(bench: Wiring) -> list[ScannedNode]:
    """List every node of the CAN buses: identity, heartbeat, the device file that fits.

    Parameters
    ----------
    bench : str, Path or BenchSpec
        Bench file, its contents, or a bus (:func:`can_bus`).

    Returns
    -------
    list of ScannedNode
        Empty where no node answers.

    Raises
    ------
    FileError
        For an invalid bench file.
    ConnectionLost
        Where a bus cannot be reached.
    NotPermitted
        Where the owner of the bench accepts no client.
    """
    return nodes_on(_spec(bench))


def drive_info(bench: Wiring, who: str | None = None, *, device: str | None = None) -> DriveInfo:
    """Read identity, state, limits and error history of a drive.

    Parameters
    ----------
    bench : str, Path or BenchSpec
        As of :func:`scan`, with its errors.
    who : str, optional
        Winch or node number; by default the only winch.
    device : str, optional
        Device file of a node that is no winch.

    Returns
    -------
    DriveInfo
        The values that were read.
    """
    with drive_at(_spec(bench), who, device=device) as node:
        return read_info(node.objects)


def config_save(
    bench: Wiring, path: str | Path, who: str | None = None, *, replace: bool = False
) -> tuple[str, ...]:
    """Read all settings of a drive into a file, ``.dcf`` or ``.json``.

    Parameters
    ----------
    bench, who
        As of :func:`drive_info`, with its errors.
    path : str or Path
        File to write.
    replace : bool
        Write over an existing file.

    Returns
    -------
    tuple of str
        Settings that the drive refused to give, with the reason.

    Raises
    ------
    UsageError
        Where the file exists and is not to be replaced.
    """
    path = path_of(path)
    refuse_existing(path, replace)
    with drive_at(_spec(bench), who) as node:
        config = read_config(node.objects)
        write_config_file(path, config, node.eds, node.node, node.bitrate)
    return tuple(config.refused)


def config_diff(bench: Wiring, path: str | Path, who: str | None = None) -> list[Difference]:
    """Compare a file of settings with a drive.

    Parameters
    ----------
    bench, who, path
        As of :func:`config_save`, with its errors.

    Returns
    -------
    list of Difference
        Empty where they agree.
    """
    with drive_at(_spec(bench), who) as node:
        return difference(fitting_config(Path(path), node.objects), node.objects)


def config_load(bench: Wiring, path: str | Path, who: str | None = None) -> list[Difference]:
    """Write the settings of a file that differ to a disabled drive, and read them back.

    Parameters
    ----------
    bench, who, path
        As of :func:`config_save`, with its errors.

    Returns
    -------
    list of Difference
        Settings that were written.

    Raises
    ------
    NotPermitted
        Beside a process that owns the bench, and where the drive is enabled.
    """
    with drive_at(_spec(bench), who, writes=True) as node:
        return write_config(fitting_config(Path(path), node.objects), node.objects)


def config_store(bench: Wiring, who: str | None = None) -> None:
    """Let a drive keep its present settings in its memory (1010h); asks for no confirmation.

    Parameters
    ----------
    bench, who
        As of :func:`config_load`, with its errors.
    """
    with drive_at(_spec(bench), who, writes=True) as node:
        store(node.objects)


def config_restore(bench: Wiring, who: str | None = None) -> None:
    """Let a drive take the maker's settings at its next start (1011h); asks for no confirmation.

    Parameters
    ----------
    bench, who
        As of :func:`config_load`, with its errors.
    """
    with drive_at(_spec(bench), who, writes=True) as node:
        restore(node.objects)


def lss_list(bench: Wiring) -> Identity | None:
    """Find a device without a node number.

    Parameters
    ----------
    bench : str, Path or BenchSpec
        As of :func:`scan`, with its errors; one CAN bus that no process owns.

    Returns
    -------
    Identity or None
        None where every device has a number.
    """
    with free_bus(_spec(bench)) as bus, closing(LssLine(bus)) as line:
        return line.find_unconfigured()


def lss_identify(bench: Wiring, identity: Identity | None = None) -> int | None:
    """Return the node number of a device.

    Parameters
    ----------
    bench : str, Path or BenchSpec
        As of :func:`lss_list`, with its errors.
    identity : Identity, optional
        Of the device; by default the only device on the bus.

    Returns
    -------
    int or None
        None where it has no number.

    Raises
    ------
    NoReply
        Where there is no such device.
    """
    with free_bus(_spec(bench)) as bus, closing(LssLine(bus)) as line:
        _select(line, identity)
        node = line.node()
    return None if node == UNCONFIGURED else node


def lss_set(
    bench: Wiring,
    identity: Identity | None = None,
    *,
    node: int | None = None,
    bitrate: int | None = None,
    store: bool = False,
) -> Identity:
    """Set node number and bit rate of a device.

    Parameters
    ----------
    bench, identity
        As of :func:`lss_identify`, with its errors.
    node : int, optional
        Node number, 1 to 127; valid from the next reset of communication.
    bitrate : int, optional
        bit/s; valid from the next start, where it is stored.
    store : bool
        Let the device keep both when it is switched off.

    Returns
    -------
    Identity
        Of the device.

    Raises
    ------
    UsageError
        Where there is nothing to set, or a number is out of range.
    """
    if node is None and bitrate is None and not store:
        raise UsageError("nothing to set; give node, bitrate or store")
    with free_bus(_spec(bench)) as bus, closing(LssLine(bus)) as line:
        chosen = _select(line, identity)
        line.configure(node, bitrate, store=store)
    return chosen


def bus_load(bench: str | Path | BenchSpec) -> dict[str, BusLoad]:
    """Compute the largest load of every CAN bus of a bench; opens nothing.

    Parameters
    ----------
    bench : str, Path or BenchSpec
        Bench file or its contents; raises FileError.

    Returns
    -------
    dict of str to BusLoad
        By bus: ``share`` of its bit rate, ``fastest()`` cycle that fits, s, and its frames.
    """
    spec, found = _spec(bench), {}
    read = cache(read_dictionary)
    for name, bus in spec.bus.items():
        if bus.kind != "can":
            continue
        winches = {key: one for key, one in spec.winch.items() if one.servo.bus == name}
        frames = [frame for key, one in winches.items() for frame in _frames(spec, key, one, read)]
        beats = dict.fromkeys(("host", *winches), bus.heartbeat)
        found[name] = load_of(bus.bitrate, spec.cycle, frames, beats)
    return found


def _spec(bench: Wiring) -> BenchSpec:
    return bench if isinstance(bench, BenchSpec) else read_bench(path_of(bench, "bench"))


def _select(line: LssLine, identity: Identity | None) -> Identity:
    if identity is None:
        return line.select_only()
    line.select(identity)
    return identity
