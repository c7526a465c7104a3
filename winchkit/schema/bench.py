"""Contents of a bench file (bench.toml): buses, and winches with their devices and limits."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

from winchkit.errors import UsageError, suggest
from winchkit.schema.devices.servo import Encoder, OptionSpec
from winchkit.schema.quantity import (
    Flag,
    Force,
    Frequency,
    Length,
    PositiveAcceleration,
    PositiveDuration,
    PositiveForce,
    PositiveLength,
    PositiveMass,
    PositiveSpeed,
    Quantity,
    QuantityOrNone,
    Whole,
    WholeNumber,
)
from winchkit.schema.robot_bench import RobotWiring
from winchkit.schema.table import Rule, Table

_LATCH = ".trip.json"
_UNHOMED_SHARE, _UNHOMED = 0.1, 0.02
"""Of ``limits.speed``, and m/s: at 20 mm/s an operator who sees a mark ends within 10 mm of it."""

NEEDED_BY_BUS: dict[str, tuple[str, ...]] = {
    "can": ("interface", "channel"),
    "modbus-rtu": ("port",),
    "modbus-tcp": ("host", "port"),
    "serial": ("port",),
}


Deviation = Literal["other-unit", "transaction-0", "answers-twice", "closes"]


@dataclass(frozen=True)
class BusSpec(Table):
    """One bus; ``kind`` determines which keys apply."""

    kind: Literal["can", "modbus-rtu", "modbus-tcp", "serial"]
    # can
    interface: str | None = None
    """Any python-can interface name."""
    channel: str | None = None
    bitrate: WholeNumber = 1_000_000
    node: Annotated[int, Whole(1, 127)] = 127
    """Node id of the host, for its heartbeat."""
    heartbeat: Annotated[
        float,
        Quantity("time", 2e-3, 1.0, why="a drive stops 2.5 heartbeats after the loss of its host"),
    ] = 0.05
    sdo_timeout: Annotated[
        float, Quantity("time", 0.02, 10.0, why="every request to a dead drive takes as long")
    ] = 0.5
    """For the answer to an SDO request: drives answer within some ms, and within some tenths while
    they write a flash memory."""
    # serial, modbus-rtu and modbus-tcp
    port: str | int | None = None
    """Device path of a serial port; TCP or UDP port number for network buses."""
    baudrate: WholeNumber = 115_200
    parity: Literal["N", "E", "O"] = "N"
    stopbits: Literal[1, 2] = 1
    bytesize: Literal[7, 8] = 8
    """Data bits of a character on a serial bus."""
    # modbus-tcp, and the interface socketcand
    host: str | None = None
    timeout: Annotated[
        float, Quantity("time", 1e-3, 10.0, why="a later answer is too old for control")
    ] = 0.2
    deviations: tuple[Deviation, ...] = ()
    """Deviations of the only device of a modbus-tcp bus that are accepted: it answers as another
    unit, with transaction 0, twice, or closes the connection after each answer."""

    def rules(self) -> Iterator[Rule]:
        """Each kind of bus needs its own keys."""
        for key in NEEDED_BY_BUS[self.kind]:
            if getattr(self, key) in (None, ""):
                yield key, f"missing; a {self.kind} bus needs it"
        if self.interface == "socketcand":
            for key in ("host", "port"):
                if getattr(self, key) is None:
                    yield key, "missing; the interface socketcand needs that of its daemon"
        if self.kind == "modbus-tcp" and isinstance(self.port, str):
            yield "port", f"'{self.port}' is not a TCP port; write a number such as 502"
        if self.deviations and self.kind != "modbus-tcp":
            yield "deviations", "are those of a modbus-tcp bus"
        if {"transaction-0", "answers-twice"} <= set(self.deviations):
            yield (
                "deviations",
                "transaction-0 and answers-twice exclude each other: a second answer could not be "
                "distinguished from the answer to the next request",
            )


@dataclass(frozen=True)
class DeviceRef(Table):
    """A device of ``devices/`` on a bus: a servo by ``node``, a Modbus device by ``unit``."""

    device: str
    bus: str
    node: Annotated[int, Whole(1, 127)] | None = None
    unit: Annotated[int, Whole(0, 255)] | None = None
    calibration: str | None = None
    """A file of kind ``calibration`` beside the bench, applied by the host."""
    encoder: Encoder | None = None
    """Of a servo's motor, where it is not the one of the device file."""
    rate: Frequency | None = None
    """Limit of the reading rate, Hz; by default the device's conversion rate or the line's."""


_EMERGENCY = re.compile(r"[0-9A-Fa-f]{2}([0-9A-Fa-f]{2}|xx)")
"""An emergency code of CiA 301, or the class of codes with the same first byte."""


@dataclass(frozen=True)
class LimitSpec(Table):
    """Limits that the supervisor enforces on one winch, SI."""

    speed: PositiveSpeed
    acceleration: PositiveAcceleration = 1.0
    length: tuple[Length, Length] | None = None
    tension_high: PositiveForce | None = None
    tension_slack: Force | None = None
    tension_rate: Annotated[float, Quantity("force per time", 0.0, above=True)] | None = None
    in_drive: Flag = False
    """Whether the drive also enforces ``length`` (607Dh), with a margin."""
    following_error: PositiveLength | None = None
    """Following error of the cable length at which the drive reports a fault (6065h), m."""
    torque: Annotated[float, Quantity("torque", 0.0, above=True)] | None = None
    """Maximum motor torque, enforced by the drive (6072h), N m."""
    response_time: PositiveDuration = 0.06
    """Maximum lag of the measured speed behind the commanded one, s: at least twice the time
    constant of the drive's velocity loop."""
    emergency_trips: tuple[str, ...] = ()
    """Emergency codes that trip although the drive reports no fault: ``4210``, ``42xx``."""
    quick_stop: PositiveAcceleration | None = None
    """Ramp of a quick stop in the drive (6085h), m/s^2; by default twice ``acceleration``."""
    unhomed: Annotated[float, QuantityOrNone("speed")] | None = None
    """Speed of a held jog while the cable length is not known, m/s; ``none`` forbids it. By default
    a tenth of ``speed``, at most 20 mm/s."""

    @property
    def speed_unhomed(self) -> float:
        """Speed of a held jog while the cable length is not known, m/s; 0 forbids it."""
        if self.unhomed is not None:
            return self.unhomed
        return min(_UNHOMED_SHARE * self.speed, _UNHOMED)

    @property
    def without_length(self) -> LimitSpec:
        """The limits while the cable length is not known: no limit of it can be kept."""
        return replace(self, speed=self.speed_unhomed, length=None)

    def rules(self) -> Iterator[Rule]:
        """Lower limits lie below upper ones."""
        if self.unhomed is not None and self.unhomed > self.speed:
            yield "unhomed", f"{self.unhomed:g} m/s is above `speed`, {self.speed:g} m/s"
        if self.quick_stop is not None and self.quick_stop < self.acceleration:
            yield (
                "quick_stop",
                f"{self.quick_stop:g} m/s^2 is below `acceleration`, {self.acceleration:g} m/s^2: "
                "a quick stop would take longer than a stop",
            )
        if self.in_drive and self.length is None:
            yield "in_drive", "needs `length`, the limits that the drive is to enforce"
        if self.length is not None and self.length[0] < 0:
            yield "length", f"{self.length[0]:g} m: a cable length is at least 0"
        if self.length is not None and self.length[0] >= self.length[1]:
            low, high = self.length
            yield "length", f"the lower limit {low:g} m is not below the upper limit {high:g} m"
        slack, high_tension = self.tension_slack, self.tension_high
        if slack is not None and high_tension is not None and slack >= high_tension:
            yield "tension_slack", f"{slack:g} N is not below tension_high, {high_tension:g} N"
        for code in self.emergency_trips:
            if not _EMERGENCY.fullmatch(code):
                yield "emergency_trips", f"'{code}' is not a code such as '4210' or '42xx'"


@dataclass(frozen=True)
class WinchWiring(Table):
    """One winch: its profile, its servo, its sensors, its limits."""

    profile: str
    servo: DeviceRef
    limits: LimitSpec
    cell: DeviceRef | None = None
    load: DeviceRef | None = None
    load_mass: PositiveMass | None = None
    length: DeviceRef | None = None
    temperature: DeviceRef | None = None
    brake: Flag = False
    options: OptionSpec = field(default_factory=OptionSpec)
    """Option codes of the drive, which override those of its device file; written and read back."""
    host_loss: Literal["hardware"] | None = None
    """``hardware`` where external hardware, and no object of the drive, stops the winch at a loss
    of the host; by default the mechanism that the device file declares."""
    host_loss_description: str = ""
    """Description of that hardware; reported at every start and in every log."""

    def rules(self) -> Iterator[Rule]:
        """The tension at the platform end is either measured or known."""
        if (self.host_loss is None) != (not self.host_loss_description.strip()):
            yield (
                "host_loss",
                '`host_loss = "hardware"` and `host_loss_description`, the description of the '
                "hardware that stops the winch at a loss of the host, must be given together",
            )
        if self.load is not None and self.load_mass is not None:
            yield "load_mass", "given beside a load cell 'load'; keep one of them"


@dataclass(frozen=True)
class CellWiring(Table):
    """Instruments of a winch without a drive: they are read, tared, calibrated and logged."""

    cell: DeviceRef | None = None
    load: DeviceRef | None = None
    length: DeviceRef | None = None
    temperature: DeviceRef | None = None


@dataclass(frozen=True)
class BenchSpec(Table):
    """A bench: buses and winches, or instruments only."""

    name: str
    winch: Mapping[str, WinchWiring]
    bus: Mapping[str, BusSpec]
    cells: Mapping[str, CellWiring] = field(default_factory=dict)
    """The tables ``[winch.NAME]`` of a bench without any profile, drive and limits."""
    cycle: Annotated[
        float, Quantity("time", 1e-4, 0.1, why="limits are tested and targets sent once per cycle")
    ] = 0.004
    stop_together: Flag = True
    """Whether a stop of one winch stops all winches. A trip always stops all."""
    effects: tuple[str, ...] = ()
    """Python files with user effects that profiles of its winches may contain."""
    robot: RobotWiring | None = None
    """The robot whose platform the winches move; None for winches with a load each."""
    description: str = ""
    path: str = field(default="", compare=False)
    """The file it was read from; relative paths of profiles and effects start there."""
    latch_file: str = field(default="", compare=False)
    """File in which latched trips are saved; empty for a simulation in this process."""

    @property
    def position_file(self) -> str:
        """File in which positions are saved, beside that of the trips; empty as that is."""
        return f"{self.latch_file.removesuffix(_LATCH)}.position.json" if self.latch_file else ""

    @property
    def record_file(self) -> str:
        """The commissioning record beside the bench file; empty for a bench without a file."""
        return f"{Path(self.path).with_suffix('')}.commissioned.json" if self.path else ""

    @property
    def effect_files(self) -> tuple[Path, ...]:
        """The files of ``effects``; relative paths start at the folder of the bench file."""
        return tuple(Path(self.path).parent / file for file in self.effects)

    def require_winches(self) -> None:
        """Raise UsageError for a bench of instruments only."""
        if self.cells:
            raise UsageError(
                f"bench '{self.name}' has no winch, only the instruments of {', '.join(self.cells)}"
                ": `cell`, `tare`, `log` and `check` are its commands; a winch has `profile`, "
                "`servo` and `limits` in its table [winch.NAME]"
            )

    def winch_named(self, name: str | None) -> str:
        """The name of a winch, or of the only one for None; raises UsageError."""
        self.require_winches()
        if name is None and len(self.winch) == 1:
            return next(iter(self.winch))
        if name is None or name not in self.winch:
            what = f"no winch '{name}'" if name else "no winch is given"
            known = list(self.winch)
            raise UsageError(f"{what}; it has {', '.join(known)}" + suggest(name or "", known))
        return name

    def with_effects(self, files: Iterable[str | Path]) -> BenchSpec:
        """The bench with further files of effects; relative paths start at the working folder."""
        return replace(self, effects=(*self.effects, *(str(Path(f).absolute()) for f in files)))


def latch_path(bench_path: str) -> str:
    """File of a bench's latched trips, beside its bench file."""
    return f"{Path(bench_path).resolve().with_suffix('')}{_LATCH}"
