"""Immutable snapshots of a bench at one control cycle, for other threads."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum, Flag
from typing import Any, NamedTuple


class Direction(Flag):
    """Directions of cable motion."""

    NONE = 0
    WIND_IN = 1
    PAY_OUT = 2
    BOTH = 3


class Phase(Enum):
    """Phase of a winch's operation."""

    DISABLED = "disabled"
    ENABLING = "enabling"
    MOVING = "moving"
    RUN_DOWN = "running down"
    STOPPING = "stopping"
    RESETTING = "resetting"


@dataclass(frozen=True, slots=True)
class Trip:
    """A condition that forbids motion, or stopped it."""

    kind: str
    winch: str
    message: str
    blocks: Direction = Direction.BOTH
    latches: bool = False
    """Whether it is latched even if nothing moved when it occurred."""

    def __str__(self) -> str:
        return f"winch {self.winch}: {self.message}" if self.winch else self.message


class WinchSnapshot(NamedTuple):
    """One winch; SI, NaN where there is no valid value."""

    phase: Phase
    state: str
    """Power state of the drive, in the words of CiA 402."""
    time: float
    """Of the SYNC at which the drive's values were sampled, s."""
    motor_angle: float
    motor_velocity: float
    motor_torque: float
    cable_length: float
    """From the motor angle and the tension, by the profile and its effects, m."""
    cable_speed: float
    """Derivative of the cable length (positive pays out), m/s."""
    tension: float = math.nan
    """The load cell's reading, N."""
    load: float = math.nan
    load_tension: float = math.nan
    """At the platform end: the load, else from the cell's reading by the profile's effects, N."""
    length: float = math.nan
    """From the length instrument."""
    temperature: float = math.nan
    quality: Mapping[str, str] | None = None
    """Flags of each sensor's newest reading, ``stale`` included."""
    length_known: bool = True
    """Whether the cable length is known; if not, it is NaN until the winch is homed."""
    commander: str = ""
    """Name of its commander; empty where it has none."""
    commanded_speed: float = math.nan
    """Commanded derivative of the cable length (positive pays out), m/s."""
    trim_angle: float = 0.0
    """Motor angle, rad, by which corrections of a platform's cable forces have elongated the cable
    since the winch was homed: of a motion of the platform there is none in it."""

    def without_values(self, phase: Phase, state: str) -> WinchSnapshot:
        """The winch once nothing measured is valid any more, e.g. after the loop has failed."""
        nan = math.nan
        return WinchSnapshot(
            phase,
            state,
            self.time,
            motor_angle=nan,
            motor_velocity=nan,
            motor_torque=nan,
            cable_length=nan,
            cable_speed=nan,
            length_known=self.length_known,
            commander=self.commander,
        )


class WinchSnapshots(Mapping[str, WinchSnapshot]):
    """The winches of a cycle by name, made at the first access: most cycles have none."""

    __slots__ = ("_made", "_make", "phases")

    def __init__(
        self, make: Callable[[], dict[str, WinchSnapshot]], phases: Callable[[], list[Phase]]
    ) -> None:
        self._make = make
        self._made: dict[str, WinchSnapshot] | None = None
        self.phases = phases
        """Phase of each winch, which needs no snapshot."""

    def _all(self) -> dict[str, WinchSnapshot]:
        made = self._made
        if made is None:
            made = self._made = self._make()
        return made

    def __getitem__(self, name: str) -> WinchSnapshot:
        return self._all()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())

    def __repr__(self) -> str:
        return repr(self._all())


@dataclass(frozen=True, slots=True)
class BenchSnapshot:
    """All winches at one cycle."""

    time: float
    """On the bench's clock, s."""
    cycle: int
    """Number of the control cycle."""
    winch: Mapping[str, WinchSnapshot]
    """State of each winch."""
    tripped: tuple[Trip, ...] = ()
    """Latched, until a reset."""
    blocked: tuple[Trip, ...] = ()
    """Conditions that hold now and forbid motion."""
    overruns: int = 0
    """Periods of control in which no cycle began, since the bench was opened."""
    warnings: tuple[Trip, ...] = ()
    """Conditions that hold and forbid nothing."""

    @property
    def at_rest(self) -> bool:
        """Whether every drive is disabled and stands still."""
        winch = self.winch
        if isinstance(winch, WinchSnapshots):
            return all(phase is Phase.DISABLED for phase in winch.phases())
        return all(item.phase is Phase.DISABLED for item in winch.values())


def to_dict(snapshot: BenchSnapshot) -> dict[str, Any]:
    """The snapshot as JSON has it: null for what is not a number."""
    winches = {
        name: {key: _plain(value) for key, value in item._asdict().items()}
        for name, item in snapshot.winch.items()
    }
    return {
        "schema": 1,
        "time": snapshot.time,
        "cycle": snapshot.cycle,
        "overruns": snapshot.overruns,
        "winch": winches,
        "tripped": [str(trip) for trip in snapshot.tripped],
        "blocked": [str(trip) for trip in snapshot.blocked],
        "warnings": [str(trip) for trip in snapshot.warnings],
    }


def _plain(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
