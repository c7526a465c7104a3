"""Winches and motions that the tests of the plant share."""

from __future__ import annotations

from dataclasses import replace
from math import pi

from winchkit.schema.bench import BenchSpec, DeviceRef, LimitSpec, WinchWiring
from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    GuideSpec,
    PulleySpec,
    ReferenceSpec,
    WinchProfile,
)
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.simbench import HiddenSpec, NoiseSpec, SimBench, WinchTruth
from winchkit.sim.plant.plant import WinchPlant
from winchkit.sim.plant.servo import DriveCommand

GRAVITY = 9.80665

SPIRAL = WinchProfile(
    name="spiral",
    drum=DrumSpec("spiral", 0.06, layer_growth=0.0005),
    gearbox=GearboxSpec(20.4),
    reference=ReferenceSpec(0.3, 4.0, 4.0),
    cable=CableSpec(dead_length=1.5),
    pulley=(PulleySpec(0.04, pi / 2), PulleySpec(0.04, pi / 3)),
)
GROOVED = replace(
    SPIRAL,
    name="grooved",
    drum=DrumSpec("grooved", 0.06, groove_pitch=0.005),
    guide=GuideSpec(0.005, 1.0, 0.4),
)


def plant(
    profile: WinchProfile = GROOVED,
    *hidden: HiddenSpec,
    load_mass: float = 20.0,
    cable_length: float | None = None,
    temperature: float = 20.0,
    drift: float = 0.0,
) -> WinchPlant:
    """A plant without noise."""
    truth = WinchTruth(
        hidden=hidden, load_mass=load_mass, temperature=temperature, temperature_drift=drift
    )
    return WinchPlant(profile, truth, seed=1, cable_length=cable_length)


def hide(physics: str, **numbers: object) -> HiddenSpec:
    return HiddenSpec(physics, numbers)


def cruise(winch: WinchPlant, speed: float, duration: float) -> None:
    """Run at a motor speed until everything that swings has settled."""
    winch.advance(duration, DriveCommand(speed=speed))


def bench(**changes: object) -> SimBench:
    """One grooved winch with every instrument, without noise by default."""
    device = DeviceRef("x", "b", unit=1)
    wiring = WinchWiring(
        "grooved",
        DeviceRef("y", "c", node=1),
        LimitSpec(speed=0.6, acceleration=1.5, length=(0.5, 5.0)),
        cell=device,
        length=device,
        temperature=device,
    )
    spec = BenchSpec("bench", {"A": wiring}, {})
    simulated = SimBench("bench", spec, {"A": WinchTruth(load_mass=10.0)}, NoiseSpec())
    return replace(simulated, **changes)


def programme(*steps: ProgrammeStep, repeat: int = 1) -> Programme:
    return Programme("try", steps, repeat)
