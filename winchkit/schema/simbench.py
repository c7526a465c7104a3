"""Contents of a simulated bench: bench, true values, hidden effects, noise and faults."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from winchkit.schema.bench import BenchSpec
from winchkit.schema.quantity import Duration, PositiveDuration, PositiveMass, Quantity, Temperature
from winchkit.schema.sim_platform import PlatformTruth
from winchkit.schema.table import Table


@dataclass(frozen=True)
class HiddenSpec(Table):
    """An effect of the simulator's own physics; ``answers`` is for scoring only."""

    physics: str
    """Name in the simulator's table of physics, which is separate from the catalogue of effects."""
    numbers: Mapping[str, Any]
    answers: tuple[str, ...] = ()


@dataclass(frozen=True)
class WinchTruth(Table):
    """True values of one winch that differ from its profile."""

    overrides: Mapping[str, Any] = field(default_factory=dict)
    """Dotted profile keys with their true values, e.g. ``{"drum.winding_radius": "60.4 mm"}``."""
    hidden: tuple[HiddenSpec, ...] = ()
    load_mass: PositiveMass = 20.0
    """Mass on the cable until a programme requests another, kg."""
    temperature: Temperature = 20.0
    temperature_drift: Annotated[float, Quantity("temperature drift")] = 0.0
    """K per hour."""


@dataclass(frozen=True)
class NoiseSpec(Table):
    """Standard deviations of the instruments' noise, SI."""

    cable_length: Annotated[float, Quantity("length", 0.0)] = 0.0
    tension: Annotated[float, Quantity("force", 0.0)] = 0.0
    motor_torque: Annotated[float, Quantity("torque", 0.0)] = 0.0
    load: Annotated[float, Quantity("force", 0.0)] = 0.0
    temperature: Annotated[float, Quantity("temperature difference", 0.0)] = 0.0
    colour: Annotated[float, Quantity("ratio", 0.0, 1.0)] = 0.0
    """Share of the variance that is first-order coloured noise, 0 to 1."""
    colour_time: PositiveDuration = 1.0


@dataclass(frozen=True)
class FaultSpec(Table):
    """A fault at a time."""

    time: Duration
    kind: str
    target: str
    numbers: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class SimBench(Table):
    """A simulated bench: a bench, and the true values of each winch and of a robot's platform."""

    name: str
    bench: BenchSpec
    truth: Mapping[str, WinchTruth]
    noise: NoiseSpec = field(default_factory=NoiseSpec)
    fault: tuple[FaultSpec, ...] = ()
    description: str = ""
    platform: PlatformTruth | None = None
    """True platform of a robot; None for winches with a load each."""

    @property
    def answers(self) -> tuple[str, ...]:
        """Catalogue ids of the hidden effects; for scoring only."""
        hidden = [spec for truth in self.truth.values() for spec in truth.hidden]
        return tuple(effect for spec in hidden for effect in spec.answers)


def dotted_keys(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Values of tables within tables by dotted keys, as of :attr:`WinchTruth.overrides`."""
    for key, value in tree.items():
        if isinstance(value, Mapping):
            yield from dotted_keys(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
