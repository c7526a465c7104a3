"""Effects on the tension before the pulleys: stated load, cable weight, lever of the load."""

from __future__ import annotations

from math import sin

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values, with_gain
from winchkit.effects.location import GRID_OF_PLACES, window
from winchkit.effects.transition import CABLE_TRANSITION, cable_direction
from winchkit.model.stages import At, Stage
from winchkit.units import GRAVITY

MASS_PER_LENGTH = Parameter(
    "mass_per_length",
    "kg/m",
    null=0.0,
    typical=0.14,
    low=0.0,
    high=50.0,
    plausible=Plausible(0.0, 20.0, "a steel cable of 70 mm has 20 kg/m"),
)
"""Of the cable."""


LOAD_GAIN = Effect(
    id="load-gain",
    stage=Stage.LOAD,
    parameters=(
        Parameter(
            "gain_error",
            "1",
            null=0.0,
            typical=0.01,
            low=-0.9,
            high=10.0,
            plausible=Plausible(
                -0.5, 1.0, "a weight is per cent off; a factor of two is another weight, or a unit"
            ),
        ),
    ),
    apply=with_gain,
    outputs=("tension", "motor_torque"),
    variable="load",
    what="The load differs from the one that the runs state, by the same share in all of them.",
    formula="(1 + g) F, F the column 'load', or the force of 'load_mass'",
    source="conventional mass and its tolerance (OIML R 111); error of sensitivity of the cell at "
    "the load",
    looks_like="The same share of the load in tension and torque, in both directions.",
    confused_with=("cell-gain", "torque-constant", "drum-radius"),
    told_apart="Tension and torque together: each instrument's own gain changes one of them. "
    "Otherwise weigh the load.",
    needs=("cable", "load"),
    left_out="it corrects the load that runs state; correct 'load_mass', or calibrate that cell",
)


def _load_offset(force: Array, at: At, values: Values) -> Array:
    """Force with a mass that hangs beside the stated one, and moves with it."""
    if at.payload:
        return force * (1.0 + values["mass"] / at.payload)
    return force + GRAVITY * values["mass"]


LOAD_OFFSET = Effect(
    id="load-offset",
    stage=Stage.LOAD,
    parameters=(Parameter("mass", "kg", null=0.0, typical=0.5, low=-1e4, high=1e5),),
    apply=_load_offset,
    outputs=("tension", "motor_torque"),
    what="The load is heavier by the same mass in all runs: a hook, a block, a sling.",
    formula="F (1 + m/M), M the run's load_mass; F + m g without it",
    source="weight and inertia of a mass that was not weighed",
    looks_like="The same force in tension and torque at every load, in both directions.",
    confused_with=("load-gain", "cell-offset", "motor-coulomb-asymmetry"),
    told_apart="Tension and torque together; two loads distinguish it from a share of the load.",
    needs=("cable", "load_mass"),
    left_out="it corrects the load that runs state; weigh the hook, and correct 'load_mass'",
)


def _cable_weight(tension: Array, at: At, values: Values) -> Array:
    """Tension plus the weight of the free cable along its direction."""
    along = GRAVITY * sin(at.profile.path.inclination)
    return tension + values["mass_per_length"] * along * at.free_length


CABLE_WEIGHT = Effect(
    id="cable-weight",
    stage=Stage.CABLE_WEIGHT,
    parameters=(MASS_PER_LENGTH,),
    apply=_cable_weight,
    outputs=("tension", "motor_torque"),
    variable="cable_length",
    what="The weight of the free cable adds to the tension towards the winch.",
    formula="T + m g ℓ sin(inclination)",
    source="statics; 6 mm steel cable 0.14 kg/m",
    looks_like="A tension error in proportion to the free length, at any load.",
    confused_with=("cell-offset", "cell-drift"),
    told_apart="The full stroke, up and down.",
    needs=("load",),
)


def _load_lever(tension: Array, at: At, values: Values) -> Array:
    return tension * (1.0 + values["amplitude"] * np.sin(at.drum_angle + values["phase"]))


LOAD_LEVER = Effect(
    id="load-lever",
    stage=Stage.CABLE_WEIGHT,
    parameters=(
        Parameter("amplitude", "1", null=0.0, typical=0.02, low=0.0, high=10.0),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=_load_lever,
    outputs=("tension", "motor_torque"),
    part="load",
    variable="drum_angle",
    what="The load acts through a lever, whose effective arm changes with its angle.",
    formula="(1 + a sin(φ + p)) T, φ the drum angle",
    source="statics: the arm of a force on a lever is its length times the cosine of its angle",
    looks_like="A sine of the drum angle in tension and torque, in proportion to the load.",
    confused_with=("drum-eccentricity", "drum-unbalance", "cell-gain"),
    told_apart="Two loads; the tension, which an eccentric or unbalanced drum leaves unchanged.",
    needs=("load",),
    order=1,
    polar=("amplitude", "phase"),
)


def _load_coulomb(tension: Array, at: At, values: Values) -> Array:
    return tension + values["force"] * cable_direction(at, values)


LOAD_COULOMB = Effect(
    id="load-coulomb",
    stage=Stage.CABLE_WEIGHT,
    parameters=(
        Parameter("force", "N", null=0.0, typical=2.0, low=0.0, high=1e7),
        CABLE_TRANSITION,
    ),
    apply=_load_coulomb,
    outputs=("tension", "motor_torque"),
    part="load",
    variable="direction",
    what="The friction of the load's guide, or of a seal on the cable, is constant.",
    formula="T + s F",
    source="Coulomb friction of a linear guide",
    looks_like="Steps of tension and torque with the direction, alike under every load.",
    confused_with=("pulley-coulomb", "pulley-capstan", "motor-coulomb"),
    told_apart="Two loads, since that of a pulley grows with the load; the tension, in which "
    "friction of the motor is not.",
    needs=("load",),
)


VISCOSITY = Parameter("viscosity", "N s/m", null=0.0, typical=10.0, low=0.0, high=1e6)
"""Of a friction along the cable."""


def with_viscous_force(tension: Array, at: At, values: Values) -> Array:
    """Tension with a friction in proportion to the speed of the cable, (n,)."""
    return tension + values["viscosity"] * at.speed


LOAD_VISCOUS = Effect(
    id="load-viscous",
    stage=Stage.CABLE_WEIGHT,
    parameters=(VISCOSITY,),
    apply=with_viscous_force,
    outputs=("tension", "motor_torque"),
    part="load",
    variable="speed",
    what="The friction of the load's guide or damper is in proportion to the cable speed.",
    formula="T + c v",
    source="viscous friction",
    looks_like="A tension error that is odd and linear in the speed, at any load.",
    confused_with=("pulley-viscous", "load-coulomb"),
    told_apart="A run of the cable without the load's guide; from dry friction, several speeds.",
    needs=("load",),
    order=1,
)


def _load_friction_at_place(tension: Array, at: At, values: Values) -> Array:
    return tension + values["force"] * cable_direction(at, values) * window(at.free_length, values)


LOAD_FRICTION_AT_PLACE = Effect(
    id="load-friction-at-place",
    stage=Stage.CABLE_WEIGHT,
    parameters=(
        Parameter("force", "N", null=0.0, typical=2.0, low=0.0, high=1e7),
        Parameter(
            "place", "m", null=0.0, typical=0.1, low=-1e5, high=1e5,
            role="shape", grid=GRID_OF_PLACES, over="cable_length",
        ),
        Parameter(
            "width", "m", null=1.0, typical=0.1, low=1e-5, high=1e4,
            role="shape", grid=(1 / 12,), along="cable_length",
        ),
        CABLE_TRANSITION,
    ),
    apply=_load_friction_at_place,
    outputs=("tension", "motor_torque"),
    part="load",
    reduces_to=("load-coulomb",),
    what="The load, or the cable before the last pulley, has more friction around one position.",
    formula="T + s F exp(−((ℓ − ℓ0)/w)²), ℓ the free length",
    source="Coulomb friction with a smooth window",
    looks_like="A bump of tension and torque error over the position, with the sign of the "
    "direction.",
    confused_with=("friction-at-place", "pulley-coulomb"),
    told_apart="The tension, in which friction of the motor is not. The full stroke, both ways.",
    needs=("load",),
    order=2,
)  # fmt: skip
