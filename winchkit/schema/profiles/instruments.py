"""Instruments of a robot: numbers beside the machine's, known or ``"unknown"``.

    [instrument.tracker]
    frame = "unknown"
    reflector = ["10 mm", "5 mm", "25 mm"]

An unknown number is estimated from the poses beside the parameters of the robot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import asin, atan2, hypot
from typing import Annotated, Literal

from winchkit.errors import UsageError, suggest
from winchkit.schema.quantity import Marker, Quantity
from winchkit.schema.table import Rule, Table

UNKNOWN = "unknown"
Vector = tuple[float, float, float]
Unknown = Literal["unknown"]


@dataclass(frozen=True)
class FrameSpec:
    """Pose of the robot's base frame in the tracker's frame."""

    position: Vector
    """m."""
    rotation: Vector
    """Roll, pitch and yaw, rad."""


_LEAST_LEVEL = 0.1
"""Level share of the way from origin to x_point below which an error of ``up`` turns the x axis by
ten times itself (rule of thumb)."""


def _through(origin: Vector, x_point: Vector, up: Vector) -> FrameSpec:
    """Frame with its origin in a point, z upwards, x towards another that is not above it."""
    way = [b - a for a, b in zip(origin, x_point, strict=True)]
    z = [k / hypot(*up) for k in up]
    height = sum(a * k for a, k in zip(way, z, strict=True))
    x = [a - height * k for a, k in zip(way, z, strict=True)]
    length = hypot(*x)
    if length <= _LEAST_LEVEL * hypot(*way):
        raise UsageError(
            f"x_point is {length * 1e3:g} mm beside origin across up, on a way of "
            f"{hypot(*way) * 1e3:g} mm, which gives no x axis; measure a point on the x axis, far "
            "from origin"
        )
    x = [k / length for k in x]
    y2 = z[0] * x[1] - z[1] * x[0]
    return FrameSpec(origin, (atan2(y2, z[2]), -asin(x[2]), atan2(x[1], x[0])))


@dataclass(frozen=True)
class _OrUnknown(Marker):
    """Marks a field that is a quantity, or several of one dimension, or ``"unknown"``."""

    dimension: str
    count: int = 1

    @property
    def wanted(self) -> str:
        """Description of the expected value."""
        one = Quantity(self.dimension).wanted
        return f'"{UNKNOWN}" or ' + (one if self.count == 1 else f"{self.count} values: {one} each")

    def read(self, raw: object) -> float | Vector | Unknown:
        """Convert a value of a file to SI; raises UsageError with the reason."""
        if raw == UNKNOWN:
            return "unknown"
        marker = Quantity(self.dimension)
        if self.count == 1:
            if isinstance(raw, str) and not any(c.isdigit() for c in raw):
                raise UsageError(f"expected {self.wanted}, not '{raw}'{suggest(raw, [UNKNOWN])}")
            return marker.read(raw)
        return _vector(raw, marker, self.wanted)


@dataclass(frozen=True)
class _Frame(Marker):
    """Marks a field that is the pose of a frame, or ``"unknown"``."""

    @property
    def wanted(self) -> str:
        """Description of the expected value."""
        return (
            f'"{UNKNOWN}" or {{ position = ["0 mm", "0 mm", "0 mm"], '
            'rotation = ["0 deg", "0 deg", "0 deg"] } or measured points '
            '{ origin = ["0 mm", "0 mm", "0 mm"], x_point = ["1 m", "0 mm", "0 mm"] }'
        )

    def read(self, raw: object) -> FrameSpec | Unknown:
        """Convert a value of a file to SI; raises UsageError with the reason."""
        if raw == UNKNOWN:
            return "unknown"
        given = raw if isinstance(raw, dict) else {}

        def vector(key: str, dimension: str) -> Vector:
            return _vector(given[key], Quantity(dimension), self.wanted)

        if given.keys() == {"position", "rotation"}:
            return FrameSpec(vector("position", "length"), vector("rotation", "angle"))
        if given.keys() | {"up"} == {"origin", "x_point", "up"}:
            up = vector("up", "ratio") if "up" in given else (0.0, 0.0, 1.0)
            if not any(up):
                raise UsageError("up is zero; it is the direction against gravity")
            return _through(vector("origin", "length"), vector("x_point", "length"), up)
        raise UsageError(f"expected {self.wanted}, not {raw!r}")


def _vector(raw: object, marker: Quantity, wanted: str) -> Vector:
    if not isinstance(raw, list | tuple) or len(raw) != 3:
        raise UsageError(f"expected {wanted}, not {raw!r}")
    x, y, z = (marker.read(item) for item in raw)
    return x, y, z


@dataclass(frozen=True)
class _PerLine(Marker):
    """Marks a field with a quantity per line by its name, or ``"unknown"``."""

    dimension: str
    unit: str
    limit: float = float("inf")
    """Largest size of a value."""

    @property
    def wanted(self) -> str:
        """Description of the expected value."""
        return f'"{UNKNOWN}" or a value per line: {{ LINE = "{self.unit}", … }}'

    def read(self, raw: object) -> Mapping[str, float] | Unknown:
        """Convert a value of a file to SI; raises UsageError with the reason."""
        if raw == UNKNOWN:
            return "unknown"
        if not isinstance(raw, dict):
            raise UsageError(f"expected {self.wanted}, not {raw!r}")
        marker = Quantity(self.dimension)
        out = {}
        for line, value in raw.items():
            out[str(line)] = marker.read(value)
            if not abs(out[str(line)]) < self.limit:
                raise UsageError(
                    f"line {line}: {value} is not below {self.limit:g} in size; it is a relative "
                    "error, such as 2 %"
                )
        return out


PerLine = Mapping[str, float] | Unknown
Frame = Annotated[FrameSpec | Unknown, _Frame()]
Place = Annotated[Vector | Unknown, _OrUnknown("length", 3)]
Turn = Annotated[Vector | Unknown, _OrUnknown("angle", 3)]
Ratio = Annotated[float | Unknown, _OrUnknown("ratio")]
Time = Annotated[float | Unknown, _OrUnknown("time")]
_NONE: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class TrackerSpec(Table):
    """Instrument that measures positions, and rotations where no IMU is declared."""

    frame: Frame = FrameSpec(_NONE, _NONE)
    """Pose of the robot's base frame in the tracker's, by its numbers or by points that the tracker
    measured: the origin, a point towards x, and the direction against gravity (z of a levelled
    tracker). One per session where it is unknown."""
    reflector: Place = _NONE
    """Observed point in the platform's frame, m."""
    scale: Ratio = 0.0
    """Relative error of measured distances."""
    mounting: Turn = _NONE
    """Roll, pitch and yaw of the target's axes in the platform's frame, rad."""
    delay: Time = 0.0
    """Time by which a reading is older than those of the winches at the same time stamp, s."""
    datum: Literal["robot", "tracker"] = "robot"
    """Frame in which a calibration writes exit points and home pose where the tracker's frame is
    unknown."""

    def rules(self) -> Iterator[Rule]:
        """A scale differs from one by a small amount."""
        if not isinstance(self.scale, str) and not abs(self.scale) < 0.5:
            yield "scale", f"{self.scale:g} is a relative error, such as 12 ppm, below 50 %"


@dataclass(frozen=True)
class ImuSpec(Table):
    """Inertial measurement unit on the platform: roll and pitch against gravity."""

    mounting: Turn = _NONE
    """Roll, pitch and yaw of its axes in the platform's frame, rad."""


@dataclass(frozen=True)
class CellsSpec(Table):
    """Load cells of the lines."""

    gain: Annotated[PerLine, _PerLine("ratio", "1 %", 0.9)] = field(default_factory=dict)
    """Relative error of each cell's span: a reading is (1 + gain) times the cable force."""


@dataclass(frozen=True)
class LengthCountersSpec(Table):
    """Instruments of ``LINE.cable_length``."""

    scale: Annotated[PerLine, _PerLine("ratio", "0.1 %", 0.5)] = field(default_factory=dict)
    """Relative error of each instrument: a reading is (1 + scale) times the length, and an
    offset."""


@dataclass(frozen=True)
class SwivelsSpec(Table):
    """Encoders of the swivel pulleys."""

    zero: Annotated[PerLine, _PerLine("angle", "1 deg")] = "unknown"
    """Reading of each encoder at the swivel angle zero; fitted where it is unknown."""


@dataclass(frozen=True)
class InstrumentSpec(Table):
    """Instruments of a robot."""

    tracker: TrackerSpec = field(default_factory=TrackerSpec)
    imu: ImuSpec | None = None
    cells: CellsSpec = field(default_factory=CellsSpec)
    length_counters: LengthCountersSpec = field(default_factory=LengthCountersSpec)
    swivels: SwivelsSpec = field(default_factory=SwivelsSpec)

    def lines(self) -> Iterator[tuple[str, str]]:
        """Keys of the tables with values per line, and the names of their lines."""
        for key, values in (
            ("cells.gain", self.cells.gain),
            ("length_counters.scale", self.length_counters.scale),
            ("swivels.zero", self.swivels.zero),
        ):
            if not isinstance(values, str):
                yield from ((key, line) for line in values)
