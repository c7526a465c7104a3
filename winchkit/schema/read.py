"""Readers of declarations in TOML into frozen dataclasses in SI.

    winch = read_profile("my-winch.toml")
    winch = read_profile("bench-spiral")  # shipped

Every function raises FileError with all faults of the file at once, each with its line:
``bench.toml:12: winch.A.limits.speed: unknown speed unit 'm/sec'; use one of m/s, mm/s``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from winchkit import wings
from winchkit.arguments import path_of
from winchkit.catalog import Kind, find
from winchkit.errors import Fault, FileError
from winchkit.schema.bench import BenchSpec
from winchkit.schema.calibration import CellCalibration, TareBook
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.register_numbers import with_addresses
from winchkit.schema.mapping import ImportMapping
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.sizing import SizeSpec
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.programme import Programme
from winchkit.schema.reading import bench as benches
from winchkit.schema.reading.lines import Key
from winchkit.schema.reading.parts import FileReading
from winchkit.schema.reading.source import open_source
from winchkit.schema.robot_programme import RobotProgramme
from winchkit.schema.simbench import SimBench

Declared = (
    WinchProfile
    | RobotProfile
    | BenchSpec
    | Programme
    | RobotProgramme
    | SimBench
    | DeviceSpec
    | SizeSpec
    | CellCalibration
    | TareBook
    | ImportMapping
)
T = TypeVar("T")
Reader = Callable[[FileReading, dict[str, Any]], Declared | None]
PathLike = str | Path


@dataclass(frozen=True)
class Declaration:
    """A file of any kind as read, with its warnings."""

    kind: str
    """As the file's key ``kind`` has it, e.g. ``winch`` or ``bench``."""
    value: Declared
    warnings: tuple[Fault, ...] = ()


def read_profile(path: PathLike) -> WinchProfile:
    """Read the profile of a winch or of an axis (a joint or a motor without drum and cable).

    Parameters
    ----------
    path : str or Path
        File in TOML of the kind ``winch`` or ``axis``, or the name of a shipped one.

    Returns
    -------
    WinchProfile
        Drum, gearbox, guide, cable, pulleys, reference and effects, in SI; an AxisProfile of the
        kind ``axis``.

    Raises
    ------
    FileError
        With every fault of the file, each with its line.
    """
    path = _located("profiles", path)
    value = read_any(path)
    # The reader of winches refuses every other kind in its own words.
    return value if isinstance(value, WinchProfile) else read_winch(path)


def read_winch(path: PathLike) -> WinchProfile:
    """Read the profile of a winch for what needs its drum; raises FileError for an axis too."""
    return _read(_located("profiles", path), "winch", WinchProfile)


def read_robot(path: PathLike) -> RobotProfile:
    """Read the profile of a cable robot, with the winch profiles that its lines name.

    Parameters
    ----------
    path : str or Path
        File in TOML of the kind ``robot``, or the name of a shipped one.

    Returns
    -------
    RobotProfile
        Platform, home pose, priors and lines, in SI.

    Raises
    ------
    FileError
        With every fault of the file, each with its line.
    """
    return _read(_located("profiles", path), "robot", RobotProfile)


def read_bench(path: PathLike) -> BenchSpec:
    """Read a bench file; its profiles and devices must exist and fit.

    Parameters
    ----------
    path : str or Path
        File in TOML of the kind ``bench``.

    Returns
    -------
    BenchSpec
        Buses, and winches with their devices and limits, in SI.

    Raises
    ------
    FileError
        With every fault of the file, each with its line.
    """
    return _read(path, "bench", BenchSpec)


def read_programme(path: PathLike) -> Programme:
    """Read a motion programme.

    Parameters
    ----------
    path : str or Path
        File in TOML of the kind ``programme``, or the name of a shipped one.

    Returns
    -------
    Programme
        Moves, holds and operator requests, in SI.

    Raises
    ------
    FileError
        With every fault of the file, each with its line.
    """
    return _read(_located("sim", path), "programme", Programme)


def read_robot_programme(path: PathLike) -> RobotProgramme:
    """Read a programme of a robot's platform: poses, arcs, blended corners and holds."""
    return _read(_located("sim", path), "robot-programme", RobotProgramme)


def read_simbench(path: PathLike) -> SimBench:
    """Read a simulated bench.

    Parameters
    ----------
    path : str or Path
        File in TOML of the kind ``sim-bench``, or the name of a shipped one.

    Returns
    -------
    SimBench
        The bench with its true values, hidden effects, noise and faults, in SI.

    Raises
    ------
    FileError
        With every fault of the file, each with its line.
    """
    return _read(_located("sim", path), "sim-bench", SimBench)


def read_device(path: PathLike) -> DeviceSpec:
    """Read a device file, or the shipped device of a name."""
    return _read(_located("devices", path), "device", DeviceSpec)


def read_size(path: PathLike) -> SizeSpec:
    """Read a sizing specification.

    Parameters
    ----------
    path : PathLike
        TOML file of the kind ``size``.

    Returns
    -------
    SizeSpec
        In SI.

    Raises
    ------
    FileError
        With every fault of the file.
    """
    return _read(path, "size", SizeSpec)


def read_calibration(path: PathLike) -> CellCalibration:
    """Read the calibration of a load cell."""
    return _read(path, "calibration", CellCalibration)


def read_tares(path: PathLike) -> TareBook:
    """Read the host's tares of a bench."""
    return _read(path, "tares", TareBook)


def read_mapping(path: PathLike) -> ImportMapping:
    """Read a mapping of another program's columns.

    Parameters
    ----------
    path : PathLike
        TOML file of the kind ``mapping``.

    Returns
    -------
    ImportMapping
        Channels, units and factors by column.

    Raises
    ------
    FileError
        With every fault of the file.
    """
    return _read(path, "mapping", ImportMapping)


def read_any(path: PathLike) -> Declared:
    """Read a declaration of the kind that it declares."""
    return load(path).value


def load(path: PathLike, kind: str | None = None) -> Declaration:
    """Read a declaration with its warnings; ``kind``, if given, is required."""
    reading = FileReading(open_source(path))
    found = reading.source.kind
    if kind is not None and found != kind:
        without = ", which has no drum and no cable" if found == "axis" else ""
        message = f"is '{found}'{without}; a '{kind}' is needed here"
        if (found, kind) == ("sim-bench", "bench"):
            message += f"; 'winchkit sim serve {path} --bench-file bench.toml' writes one"
        raise FileError(reading.source.fault(("kind",), message))
    read: Reader = _READERS.get(found) or wings.reader(found)
    value = read(reading, reading.source.tree)
    reading.refuse_faults()
    assert value is not None, "a reader that returns nothing has noted why"
    return Declaration(found, value, _warnings(reading, value))


def _located(kind: Kind, path: PathLike) -> Path:
    """A file; else, of a name without folder and ending, the shipped declaration."""
    here = path_of(path)
    if here.is_file() or here.suffix or here.parent != Path():
        return here
    return find(kind, str(here))


def _read(path: PathLike, kind: str, expected: type[T]) -> T:
    value = load(path, kind).value
    assert isinstance(value, expected)
    return value


def _table(
    kind: type[T], *, with_path: bool = False
) -> Callable[[FileReading, dict[str, Any]], T | None]:
    """Reader of a file of one table, with the file's name where it gives itself none."""

    def read(reading: FileReading, tree: dict[str, Any]) -> T | None:
        named = {"name": reading.stem, **tree}
        return reading.table(kind, _with_path(reading, named) if with_path else named)

    return read


def _with_path(reading: FileReading, tree: dict[str, Any]) -> dict[str, Any]:
    if "path" in tree:
        reading.fault(("path",), "unknown key")
    return {**tree, "path": reading.source.path}


def _device(reading: FileReading, tree: dict[str, Any]) -> DeviceSpec | None:
    if isinstance(modbus := tree.get("modbus"), Mapping):
        tree = {**tree, "modbus": with_addresses(modbus, reading.fault)}
    device = reading.table(DeviceSpec, _with_path(reading, tree))
    for table in ("servo", "process"):
        part = getattr(device, table, None)
        if part is None:
            continue
        eds = Path(reading.source.path).parent / part.eds
        if not eds.is_file():
            reading.fault((table, "eds"), f"there is no file {eds}")
    return device


_READERS: dict[str, Reader] = {
    "winch": lambda reading, tree: reading.winch(tree, reading.stem),
    "axis": FileReading.axis,
    "bench": lambda reading, tree: benches.bench(reading, tree, read_device, read_robot),
    "programme": _table(Programme),
    "sim-bench": lambda reading, tree: benches.sim_bench(reading, tree, read_device, read_robot),
    "device": _device,
    "size": _table(SizeSpec),
    "calibration": _table(CellCalibration, with_path=True),
    "tares": _table(TareBook, with_path=True),
    "mapping": _table(ImportMapping, with_path=True),
}


def _warnings(reading: FileReading, value: Declared) -> tuple[Fault, ...]:
    if isinstance(value, WinchProfile):
        return _guide_warnings(reading, value, ())
    if isinstance(value, RobotProfile):
        inline = [
            (line.winch, ("line", n, "winch"))
            for n, line in enumerate(value.line)
            if isinstance(line.winch, WinchProfile)
        ]
        return tuple(fault for winch, at in inline for fault in _guide_warnings(reading, winch, at))
    if isinstance(value, DeviceSpec) and value.modbus is not None:
        return tuple(
            reading.source.fault(("modbus", key, "start"), message)
            for key, block in (
                ("read", value.modbus.read),
                ("status_read", value.modbus.status_read),
            )
            if block is not None and (message := block.doubt)
        )
    return ()


def _guide_warnings(reading: FileReading, winch: WinchProfile, at: Key) -> tuple[Fault, ...]:
    guide, pitch = winch.guide, winch.drum.groove_pitch
    if guide is None or pitch is None:
        return ()
    travel = guide.screw_lead * guide.belt_ratio
    if abs(travel - pitch) <= 1e-6 * pitch:
        return ()
    message = (
        f"the guide moves {travel * 1e3:g} mm per drum turn, the groove {pitch * 1e3:g} mm "
        "(screw_lead x belt_ratio should equal drum.groove_pitch)"
    )
    return (reading.source.fault((*at, "guide"), message),)
