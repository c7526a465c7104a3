"""Further changes of the free length of the cable: creep, hysteresis, temperature, sag."""

from __future__ import annotations

from math import cos

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.effects.on_tension.load import MASS_PER_LENGTH
from winchkit.model.derivatives import with_turning_points
from winchkit.model.friction import dahl
from winchkit.model.recurrence import first_order_lag, share
from winchkit.model.stages import At, Stage
from winchkit.units import GRAVITY

_STUCK = 0.5
"""Share of a change of the elastic strain that is withheld right after a reversal, when all strands
stick (rule of thumb: twice the stiffness; at 0.05 the loop would need 10 times its tension range to
close)."""


def _cable_hysteresis(length: Array, at: At, values: Values) -> Array:
    """Length less the strain that the cable's internal friction withholds: half of a change of
    tension from rest, and all of it right after a full reversal, where the strands stick.
    """
    if values["fraction"] == 0.0:
        return length
    tension, own = with_turning_points(at.tension)
    limit = values["fraction"] * np.abs(tension)
    held = dahl(tension, limit, _STUCK, start=values["start"])[own]
    return length - at.stressed_length * held / values["stiffness"]


def _cable_hysteresis_carried(after: Array, before: Array, at: At, values: Values) -> Array:
    """F/F_c at the last sample."""
    limit = (
        values["fraction"] * np.abs(at.tension[-1]) * at.stressed_length[-1] / values["stiffness"]
    )
    return share(before[-1] - after[-1], limit)


CABLE_HYSTERESIS = Effect(
    id="cable-hysteresis",
    stage=Stage.CABLE,
    parameters=(
        Parameter("stiffness", "N", null=2e5, typical=2e5, low=1e3, high=1e9, role="shape"),
        Parameter(
            "fraction",
            "1",
            null=0.0,
            typical=0.05,
            low=0.0,
            high=0.9,
            plausible=Plausible(0.0, 0.5, "a cable loses less than half of its elastic force"),
        ),
        Parameter("start", "1", null=0.0, typical=0.5, low=-1.0, high=1.0, role="fixed"),
    ),
    apply=_cable_hysteresis,
    outputs=("cable_length",),
    what="Friction between strands withholds strain: loading and unloading differ.",
    formula="ℓ − ℓ_s F/EA, dF/dT = ½ (1 − s F/F_c), F_c = fraction·T; start: F/F_c at the start",
    source="Dahl friction (Cable-winding device, Eq. 25) over the tension, without its mean",
    looks_like="A hysteresis loop of the length error over the tension, at any rate.",
    confused_with=("cable-creep", "drum-winding-tension", "gear-backlash"),
    told_apart="The same tension cycle at two rates: creep changes its loop, hysteresis not.",
    needs=("cable_force",),
    order=1,
    memory=True,
    carry=_cable_hysteresis_carried,
    probes=({"fraction": 0.02}, {"fraction": 0.1}),
)


def _cable_creep(length: Array, at: At, values: Values) -> Array:
    """Length with the creep strain over free and dead length; it starts at zero strain."""
    settled = at.tension / values["creep_stiffness"]
    begun = values["start"] * settled[0]
    strain = first_order_lag(settled, at.time, values["time_constant"], begun)
    return length + at.stressed_length * strain


def _cable_creep_carried(after: Array, before: Array, at: At, values: Values) -> Array:
    """Strain over T/EA_c at the last sample; unchanged at zero tension."""
    settled = at.stressed_length[-1] * at.tension[-1] / values["creep_stiffness"]
    return share(after[-1] - before[-1], settled, values["start"])


CABLE_CREEP = Effect(
    id="cable-creep",
    stage=Stage.CABLE,
    parameters=(
        Parameter(
            "creep_stiffness",
            "N",
            null=np.inf,
            typical=1e6,
            low=1e3,
            high=np.inf,
            reciprocal=True,
        ),
        Parameter(
            "time_constant",
            "s",
            null=60.0,
            typical=60.0,
            low=0.5,
            high=1e5,
            role="shape",
            grid=(5.0, 20.0, 60.0, 200.0, 1000.0),
        ),
        Parameter("start", "1", null=0.0, typical=0.5, low=-1.0, high=2.0, role="fixed"),
    ),
    apply=_cable_creep,
    outputs=("cable_length",),
    reduces_to=("cable-elongation-linear",),
    what="Fibres and strands settle: strain follows the tension with a time constant.",
    formula="ε' = (T/EA_c − ε)/τ; start: ε over T/EA_c at the run's start",
    source="Kelvin-Voigt element; polymer cables creep up to 15 % (s00542-019-04554-5)",
    looks_like="The length drifts after a step of the load and levels off.",
    confused_with=("cable-thermal", "cable-hysteresis", "encoder-slip"),
    told_apart="Hold after a load step, then unload; temperature up and down at constant load.",
    needs=("cable_force",),
    order=2,
    memory=True,
    carry=_cable_creep_carried,
    rested=1.0,
)

_AT_DECLARED_LENGTH = 20.0
"""Degrees Celsius: reference temperature of lengths (ISO 1)."""


def _cable_thermal(length: Array, at: At, values: Values) -> Array:
    """Length with the strain α (temperature − 20 °C) over free and dead length."""
    warmer = at.temperature - _AT_DECLARED_LENGTH
    return length + at.stressed_length * (values["expansion"] * warmer)


CABLE_THERMAL = Effect(
    id="cable-thermal",
    stage=Stage.CABLE,
    parameters=(
        Parameter(
            "expansion",
            "1/K",
            null=0.0,
            typical=1.1e-5,
            low=-1e-4,
            high=1e-4,
            plausible=Plausible(-2e-05, 0.0001, "UHMWPE −1.2e-5, steel 1.1e-5, polyamide 8e-5 1/K"),
        ),
    ),
    apply=_cable_thermal,
    outputs=("cable_length",),
    variable="temperature",
    what="The cable expands (steel) or shrinks (HMPE) as it warms.",
    formula="ℓ + ℓ_s α (temperature − 20 °C)",
    source="linear thermal expansion; steel 1.1e-5 1/K, HMPE −1.2e-5 1/K",
    looks_like="A length error in proportion to temperature times length.",
    confused_with=("cable-creep",),
    told_apart="Temperature up and down at constant load.",
    needs=("temperature",),
    order=3,
    on_robot=frozenset({"all"}),
)


def _cable_sag(length: Array, at: At, values: Values) -> Array:
    """Length less w² ℓ³ cos²(inclination) / 24 T².

    The parabola is valid while the tension exceeds the cable's weight across the chord; below, that
    weight replaces the tension. Without any tension the sag is unknown and set to zero.
    """
    weight = values["mass_per_length"] * GRAVITY * np.abs(at.free_length)
    across = weight * abs(cos(at.profile.path.inclination))
    tension = np.maximum(at.tension, across)
    ratio: Array = np.divide(across, tension, out=np.zeros_like(across), where=at.tension > 0)
    return length - at.free_length * ratio**2 / 24


CABLE_SAG = Effect(
    id="cable-sag",
    stage=Stage.CABLE,
    parameters=(MASS_PER_LENGTH,),
    apply=_cable_sag,
    outputs=("cable_length",),
    variable="load",
    what="The cable's own weight bends it; the straight distance is shorter than the cable.",
    formula="ℓ − w² ℓ³ cos²(inclination) / 24 T², w weight per length",
    source="parabola for a shallow catenary (Irvine, Cable Structures)",
    looks_like="A length error only near slack and on long cables, in proportion to ℓ³/T².",
    confused_with=("cable-elongation-linear", "cable-elongation-exponential"),
    told_apart="Low tension over the full stroke; a hanging cable does not sag.",
    needs=("cable_force",),
    order=4,
    probes=({"mass_per_length": 0.14},),
)
