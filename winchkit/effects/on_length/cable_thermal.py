"""cable-thermal: thermal expansion of the cable."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage

_AT_DECLARED_LENGTH = 20.0
"""Degrees Celsius: reference temperature of lengths (ISO 1)."""


def apply(length: Array, at: At, values: Values) -> Array:
    """Length with the strain α (temperature − 20 °C) over free and dead length."""
    warmer = at.temperature - _AT_DECLARED_LENGTH
    return length + at.stressed_length * (values["expansion"] * warmer)


EFFECT = Effect(
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
    apply=apply,
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
