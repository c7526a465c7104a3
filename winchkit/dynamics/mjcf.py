"""A profile as a model of MuJoCo: an axis as one joint, a winch as a drum and a hanging load.

An effect becomes an attribute of the joint where MuJoCo has the same law; the others are listed.
The cable of a winch is an equality of both joints, whose polynomial is the drum's wound length, so
that the load follows the unstrained cable as in :func:`winchkit.forward`.
"""

from __future__ import annotations

from cmath import phase, rect
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from math import cos, pi, sin
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from winchkit.effects.term import Term
from winchkit.effects.transition import TRANSITION
from winchkit.errors import UsageError
from winchkit.model.drum import Archimedean, Grooved, Spiral, Squared, drum_of
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.units import GRAVITY

_STEP = 2.5e-4
"""s: of the integration. The stiffest parts have twice this time: the equality of the cable, and
friction that holds a motor."""
_STIFF = f"{2 * _STEP} 1"
"""``solref`` of these; by MuJoCo's 20 ms a motor would slip on after it has stopped."""
SMALL = 1e-9
"""kg and kg m²: of a body whose inertia is the armature of its joint; MuJoCo refuses zero."""
_Attributes = Mapping[str, complex]
Law = Callable[[Mapping[str, float], float], _Attributes]
"""Attributes of the joint from the values of an effect (rotary names, and the ``load`` of an axis,
kg) and the gear: motor turns per turn of the joint, negative where they turn against each other."""


def _damping(v: Mapping[str, float], i: float) -> _Attributes:
    return {"damping": v["viscosity"] * i * i}


def _spring(v: Mapping[str, float], i: float) -> _Attributes:
    return {"stiffness": v["stiffness"] * i, "springref": -v["torque"] / v["stiffness"]}


def _weight(v: Mapping[str, float], i: float) -> _Attributes:
    return {"gravity": rect(v["amplitude"] * i, v["phase"])}


def _payload(v: Mapping[str, float], _: float) -> _Attributes:
    inertia = v["load"] * v["lever"] ** 2
    return {"gravity": rect(v["load"] * GRAVITY * v["lever"], v["phase"]), "armature": inertia}


COUNTERPARTS: Mapping[str, Law] = {
    "rotor-inertia": lambda v, i: {"armature": v["inertia"] * i * i},
    "motor-viscous": _damping,
    "motor-coulomb": lambda v, i: {"frictionloss": v["torque"] * abs(i)},
    "spring-balancer": _spring,
    "joint-gravity": _weight,
    "drum-unbalance": _weight,
    "joint-payload": _payload,
}
"""Effects with the same law in MuJoCo; ``gravity`` is the torque of a body that hangs on the joint,
as amplitude and phase of a complex number."""
_ROTARY = {"mass": "inertia", "force": "torque"}


@dataclass(frozen=True)
class MujocoJoint:
    """The joint of a drum or an axis as MuJoCo has it."""

    attributes: str
    body: str
    """Inertial element of the body that it moves."""
    gear: float
    """Of the motor: joint torque by motor torque."""
    missing: list[str]
    comments: list[str]


def joint_of(
    profile: WinchProfile,
    terms: Sequence[Term],
    elsewhere: Collection[str] = (),
    load_mass: float | None = None,
) -> MujocoJoint:
    """The joint of a profile with its effects, but for those ``elsewhere``, and with the load that
    it carries, kg; raises UsageError for a profile without masses or the load."""
    found: dict[str, complex] = {}
    missing: list[str] = []
    comments: list[str] = []
    gear = profile.gearbox.ratio * profile.gearbox.direction
    fitted = {table.id: table.values.get("fitted") for table in profile.effect}
    for term in terms:
        if (std := _std(fitted.get(term.effect.id))) is not None:
            comments.append(f"{term.label}: std {std}")
        if term.effect.id in elsewhere:
            continue
        law = COUNTERPARTS.get(term.effect.id)
        values = {_ROTARY.get(name, name): value for name, value in term.values.items()}
        if law is None or values.get(TRANSITION, 0.0) != 0.0 or values.get("stiffness") == 0.0:
            more = " with a transition" if law is not None and TRANSITION in values else ""
            missing.append(f"{term.label}{more}")
            continue
        if "payloads" in term.effect.needs:
            if load_mass is None:
                raise UsageError(f"effect '{term.label}' needs the load: give --load-mass")
            values["load"] = load_mass
        for name, value in law(values, gear).items():
            found[name] = found.get(name, 0.0) + value
    gravity = found.pop("gravity", 0j)
    attributes = {name: value.real for name, value in found.items()}
    inertia = attributes.get("armature", 0.0)
    if inertia <= 0.0:
        raise UsageError(
            f"profile '{profile.name}' has no mass that MuJoCo could move: add the effect "
            "rotor-inertia"
        )
    body, attributes["armature"] = _pendulum(gravity, inertia)
    joint = " ".join(f'{name}="{value:.17g}"' for name, value in attributes.items() if value)
    if attributes.get("frictionloss"):
        joint += f' solreffriction="{_STIFF}"'
    return MujocoJoint(joint, body, gear, missing, comments)


def mjcf(
    profile: WinchProfile, terms: Sequence[Term], load_mass: float | None = None
) -> tuple[str, list[str]]:
    """The model, and what it lacks of the profile; raises UsageError for a profile without masses,
    and for a winch, or an axis with a payload, without a load (kg)."""
    joint = joint_of(profile, terms, load_mass=load_mass)
    missing = joint.missing
    is_axis = isinstance(profile, AxisProfile)
    if not is_axis and load_mass is None:
        raise UsageError(
            f"profile '{profile.name}' is a winch, and no load hangs on its cable: give --load-mass"
        )
    kind = 'type="slide" axis="1 0 0"' if profile.is_linear else 'type="hinge" axis="0 1 0"'
    load, equality = ("", "")
    if not is_axis:
        load, equality = _load(profile, load_mass or 0.0, missing)
    return (
        f"""\
{mujoco_head(profile.name, joint.comments, missing)}  <worldbody>
    <body name="machine">
      <joint name="machine" {kind} {joint.attributes}/>
      {joint.body}
    </body>
{load}  </worldbody>
{equality}  <actuator>
    <motor name="motor" joint="machine" gear="{joint.gear:.17g}"/>
  </actuator>
</mujoco>
""",
        missing,
    )


def mujoco_head(name: str, comments: Sequence[str], missing: Sequence[str]) -> str:
    """Begin of a model, with the deviations of fitted values and what it lacks."""
    lines = (*comments, *(f"no counterpart here: {one}" for one in missing))
    listed = "".join(f"\n  {escape(line)}" for line in lines)
    head = f"{escape(name)}: written by winchkit export-model; SI units, the control is"
    # A comment of XML holds no two hyphens in a row.
    comment = f"{head} the motor's torque.{listed}".replace("--", "- -").replace("--", "- -")
    return f"""\
<!-- {comment}
-->
<mujoco model={quoteattr(name)}>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{_STEP}" integrator="implicitfast" gravity="0 0 -{GRAVITY}"/>
"""


def _std(fitted: object) -> object:
    """Standard deviations of fitted values, as the profile has them."""
    return dict(fitted).get("std") if isinstance(fitted, Mapping) else None


def _pendulum(gravity: complex, inertia: float) -> tuple[str, float]:
    """Inertial element, and left armature, of a joint whose weight has the torque ``|gravity| sin(φ
    + phase)``, N m. Any mass m at a distance l with m g l of this torque is the same; half of the
    inertia is taken for it."""
    small = f'diaginertia="{SMALL} {SMALL} {SMALL}"'
    if gravity == 0.0:
        return f'<inertial pos="0 0 0" mass="{SMALL}" {small}/>', inertia
    length = inertia * GRAVITY / (2 * abs(gravity))
    mass, turn = abs(gravity) / (GRAVITY * length), phase(gravity)
    place = f"{-length * sin(turn):.17g} 0 {-length * cos(turn):.17g}"
    return f'<inertial pos="{place}" mass="{mass:.17g}" {small}/>', inertia - mass * length**2


def _load(profile: WinchProfile, mass: float, missing: list[str]) -> tuple[str, str]:
    """The load on a slide downwards, and the equality that pays out the cable."""
    body = f"""\
    <body name="load">
      <joint name="cable" type="slide" axis="0 0 -1"/>
      <inertial pos="0 0 0" mass="{mass:.17g}" diaginertia="{SMALL} {SMALL} {SMALL}"/>
    </body>
"""
    arm, growth = arm_and_growth(profile, missing)
    return body, f"  <equality>\n{wound_equality('cable', 'machine', -arm, -growth)}  </equality>\n"


def arm_and_growth(profile: WinchProfile, missing: list[str]) -> tuple[float, float]:
    """Arm at the reference, m/rad of the drum, and its growth per turn, m."""
    drum, wound = drum_of(profile), np.asarray(2 * pi * profile.reference.wound_turns)
    match drum:
        case Grooved():
            return float(drum.arm(wound)), 0.0
        case Archimedean():
            return float(drum.arm(wound)), drum.growth
        case Squared():
            return float(drum.arm(wound)), pi * drum.build_up
        case Spiral(radius, growth):
            missing.append("spiral drum, whose steps of the radius are an even growth here")
            return radius + growth * profile.reference.wound_turns, growth
    raise TypeError(f"{type(drum).__name__} is no winding law of this model")


def wound_equality(slide: str, drum: str, arm: float, growth: float) -> str:
    """Cable of a slide that a drum winds: the polynomial of its wound length, stiffly kept."""
    polynomial = f"0 {arm:.17g} {growth / (4 * pi):.17g} 0 0"
    return (
        f'    <joint joint1="{slide}" joint2="{drum}" polycoef="{polynomial}" '
        f'solref="{_STIFF}" solimp="0.999 0.9999 0.001"/>\n'
    )
