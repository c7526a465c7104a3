"""The simulator's table of physics: a name for each effect, in the order in which they act."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from winchkit.errors import Fault, FileError, suggest
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.simbench import HiddenSpec
from winchkit.sim.physics import beyond, cable, instruments, motor, pulley, winding
from winchkit.sim.physics.base import Physics
from winchkit.sim.physics.parameters import number_names, read_numbers, with_unit

PHYSICS: dict[str, type[Physics]] = {
    "fat drum": winding.FatDrum,
    "wrong ratio": winding.WrongRatio,
    "thick layers": winding.ThickLayers,
    "slip": winding.Slip,
    "wavy gear": winding.WavyGear,
    "loose gear": winding.LooseGear,
    "eccentric drum": winding.EccentricDrum,
    "five-cornered drum": beyond.FiveCornerDrum,
    "guide offset": winding.GuideOffset,
    "elastic rope": cable.ElasticCable,
    "soft frame": cable.SoftFrame,
    "creeping rope": cable.CreepingCable,
    "lagging rope": cable.LaggingCable,
    "warm rope": cable.WarmCable,
    "giving joint": beyond.GivingJoint,
    "heavy rope": cable.HeavyCable,
    "load lever": cable.LoadLever,
    "sticky pulleys": pulley.StickyPulleys,
    "presliding pulleys": pulley.PreslidingPulleys,
    "viscous pulleys": pulley.ViscousPulleys,
    "creep-sticky pulleys": pulley.CreepPulleys,
    "heavy pulleys": pulley.HeavyPulleys,
    "Maxwell-slip pulleys": pulley.MaxwellPulleys,
    "sticky place": beyond.StickyPlace,
    "stretched cell": instruments.StretchedCell,
    "shifted cell": instruments.ShiftedCell,
    "bent cell": instruments.BentCell,
    "drifting cell": instruments.DriftingCell,
    "warm cell": instruments.WarmCell,
    "leaking current": instruments.LeakingCurrent,
    "torque crosstalk": beyond.TorqueCrosstalk,
    "temperature crosstalk": beyond.TemperatureCrosstalk,
    "slow cell": instruments.SlowCell,
    "clipping cell": instruments.ClippingCell,
    "lossy gear": motor.LossyGear,
    "motor drag": motor.MotorDrag,
    "motor grease": motor.MotorGrease,
    "one-way grease": motor.OneWayGrease,
    "motor stiction": motor.MotorStiction,
    "presliding motor": motor.PreslidingMotor,
    "cogging": motor.Cogging,
    "unbalanced drum": motor.UnbalancedDrum,
    "hanging joint": motor.HangingJoint,
    "balancer": motor.Balancer,
    "growing drag": motor.GrowingDrag,
    "rough place": motor.RoughPlace,
    "heavy rotor": motor.HeavyRotor,
    "rippled motor": motor.RippledMotor,
    "weak motor": motor.WeakMotor,
    "slow torque": motor.SlowTorque,
    "late length": instruments.LateLength,
    "wandering length": beyond.WanderingLength,
}

_ORDER = {kind: place for place, kind in enumerate(PHYSICS.values())}


def build(hidden: Sequence[HiddenSpec]) -> list[Physics]:
    """Create the named effects in the order in which they act; raises FileError with all."""
    faults: list[Fault] = []
    pieces: list[Physics] = []
    for spec in hidden:
        try:
            pieces.append(_build_one(spec))
        except FileError as error:
            faults.extend(error.faults)
    if faults:
        raise FileError(faults)
    return _in_order(pieces)


def _build_one(spec: HiddenSpec) -> Physics:
    kind = PHYSICS.get(spec.physics)
    if kind is None:
        known = list(PHYSICS)
        raise FileError(
            f"hidden.physics: there is no '{spec.physics}'; known are {', '.join(known)}"
            + suggest(spec.physics, known)
        )
    return kind(**read_numbers(kind, spec.numbers, f"hidden '{spec.physics}'"))


def _in_order(pieces: Iterable[Physics]) -> list[Physics]:
    return sorted(pieces, key=lambda piece: _ORDER[type(piece)])


def declared(profile: WinchProfile, pieces: Sequence[Physics]) -> list[Physics]:
    """Add the effects of a profile's shorthand keys: elastic cable, cable weight, efficiency."""
    own: list[Physics] = []
    if profile.cable.axial_stiffness is not None:
        own.append(cable.ElasticCable(profile.cable.axial_stiffness))
    if profile.cable.mass_per_length is not None:
        own.append(cable.HeavyCable(profile.cable.mass_per_length))
    if profile.gearbox.efficiency is not None:
        own.append(motor.LossyGear(profile.gearbox.efficiency))
    if profile.motor.inertia is not None:
        own.append(motor.HeavyRotor(profile.motor.inertia))
    for piece in own:
        if any(type(other) is type(piece) for other in pieces):
            name = next(name for name, kind in PHYSICS.items() if kind is type(piece))
            raise FileError(
                f"hidden: '{name}' is hidden and {profile.name} declares it too; "
                "change the declared number under truth instead"
            )
    return _in_order([*pieces, *own])


def scaled(spec: HiddenSpec, factor: float) -> HiddenSpec:
    """The same effect, ``factor`` times as large, by the parameter of its size."""
    piece = _build_one(spec)
    if not piece.size:
        return spec
    value = getattr(piece, piece.size)
    value = value / factor if piece.inverse else value * factor
    return replace(
        spec, numbers={**spec.numbers, piece.size: with_unit(type(piece), piece.size, value)}
    )


@dataclass(frozen=True)
class ListedPhysics:
    """What a simulated bench can hide, with numbers of a typical size."""

    name: str
    description: str
    numbers: Mapping[str, str | float]


def listed_physics() -> list[ListedPhysics]:
    """Every effect of a simulated bench."""
    return [
        ListedPhysics(
            name,
            (kind.__doc__ or "").partition("\n")[0],
            {
                number: with_unit(kind, number, getattr(kind(), number))
                for number in number_names(kind)
            },
        )
        for name, kind in PHYSICS.items()
    ]
