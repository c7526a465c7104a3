"""What a wiring file (bench.toml) declares: buses, and winches with their devices and limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from winchkit.schema.quantity import (
    Force,
    Length,
    PositiveAcceleration,
    PositiveDuration,
    PositiveForce,
    PositiveMass,
    PositiveSpeed,
    Quantity,
)

__all__ = ["BenchSpec", "BusSpec", "DeviceRef", "LimitSpec", "WinchWiring"]


@dataclass(frozen=True)
class BusSpec:
    """One bus; which keys count depends on ``kind``."""

    kind: Literal["can", "modbus-rtu", "modbus-tcp", "serial"]
    # can
    interface: str | None = None
    """Any python-can interface name."""
    channel: str | None = None
    bitrate: int = 1_000_000
    node: int = 127
    """Node id of the host, for its heartbeat."""
    heartbeat: PositiveDuration = 0.05
    # serial and modbus-rtu
    port: str | int | None = None
    """Device path of a serial port; TCP or UDP port number for network buses."""
    baudrate: int = 115_200
    parity: Literal["N", "E", "O"] = "N"
    stopbits: Literal[1, 2] = 1
    # modbus-tcp
    host: str | None = None
    timeout: PositiveDuration = 0.2


@dataclass(frozen=True)
class DeviceRef:
    """A device of ``devices/`` on a bus: a servo by ``node``, a Modbus device by ``unit``."""

    device: str
    bus: str
    node: int | None = None
    unit: int | None = None


@dataclass(frozen=True)
class LimitSpec:
    """What the supervisor enforces on one winch, SI."""

    speed: PositiveSpeed
    acceleration: PositiveAcceleration = 1.0
    length: tuple[Length, Length] | None = None
    tension_high: PositiveForce | None = None
    tension_slack: Force | None = None
    tension_rate: Annotated[float, Quantity("force per time", 0.0, above=True)] | None = None


@dataclass(frozen=True)
class WinchWiring:
    """One winch: its profile, its servo, its sensors, its limits."""

    profile: str
    servo: DeviceRef
    limits: LimitSpec
    cell: DeviceRef | None = None
    load: DeviceRef | None = None
    load_mass: PositiveMass | None = None
    length: DeviceRef | None = None
    temperature: DeviceRef | None = None
    brake: bool = False


@dataclass(frozen=True)
class BenchSpec:
    """A bench as wired."""

    name: str
    winch: Mapping[str, WinchWiring]
    bus: Mapping[str, BusSpec]
    cycle: PositiveDuration = 0.004
    description: str = ""
    path: str = field(default="", compare=False)
    """The file it was read from; profiles by path are found beside it."""
