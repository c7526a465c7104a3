"""Effects on the wound length: radius, layers and runout of the drum, offset of the guide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.drum import Archimedean, Drum, Grooved, Spiral, Squared
from winchkit.model.stages import At, Path, Stage

LayeredDrum = Archimedean | Grooved | Spiral | Squared


def _drum_radius(drum: LayeredDrum, at: At, values: Values) -> LayeredDrum:
    """A drum whose first layer lies at radius r + δr."""
    return replace(drum, winding_radius=drum.winding_radius + values["radius_error"])


DRUM_RADIUS = Effect(
    id="drum-radius",
    stage=Stage.DRUM,
    parameters=(
        Parameter(
            "radius_error",
            "m",
            null=0.0,
            typical=5e-4,
            low=-0.02,
            high=0.02,
            plausible=Plausible(
                -0.2,
                0.2,
                "wear, machining and a compressed cable are per cent of the radius",
                of="drum.winding_radius",
            ),
        ),
    ),
    apply=_drum_radius,
    outputs=("cable_length", "motor_torque"),
    variable="cable_length",
    what="The winding radius differs from the profile: machining, cable compression, a wrong r.",
    formula="W(Φ; r + δr)",
    source="CABTIVE paper, Eq. 2 with r_w as a parameter (Table 7: 59 to 60.5 for 60 mm)",
    looks_like="A length error in proportion to the drum angle, at any tension.",
    confused_with=("gear-ratio", "layer-thickness"),
    told_apart="An encoder on the drum; on a layered drum a stroke over several layers.",
    on_robot=frozenset({"one", "all"}),
)


def _layer_thickness(drum: Drum, at: At, values: Values) -> Drum:
    """A layered drum with growth g + δ; other drums have no layers and are unchanged."""
    if isinstance(drum, Spiral | Archimedean):
        return replace(drum, growth=drum.growth + values["thickness_error"])
    return drum


LAYER_THICKNESS = Effect(
    id="layer-thickness",
    stage=Stage.DRUM,
    parameters=(
        Parameter(
            "thickness_error",
            "m",
            null=0.0,
            typical=1e-4,
            low=-0.005,
            high=0.005,
            plausible=Plausible(
                -1.0, 1.0, "a layer is between nothing and two cables thick", of="cable.diameter"
            ),
        ),
    ),
    apply=_layer_thickness,
    outputs=("cable_length", "motor_torque"),
    variable="cable_length",
    what="The layer growth differs from the profile: the cable flattens or nests.",
    formula="W(Φ; g + δ)",
    source="CABTIVE paper, Eq. 2 with d_c as a parameter (Table 4: 0.42 to 0.54 mm)",
    looks_like="A parabola of the length error over the drum angle; torque follows the radius.",
    confused_with=("guide-offset", "drum-radius"),
    told_apart="A constant weight over the whole stroke: layers change the torque, a guide hardly.",
    needs=("layers",),
    on_robot=frozenset({"all"}),
)


def _with_wave(path: Path, size: float, angle: Array, phase: float, rate: Array | float) -> Path:
    """Wound length plus a (sin(α − p) + sin p), and its derivative; ``rate`` is that of α."""
    turned = angle - phase
    return Path(
        path.value + size * (np.sin(turned) + np.sin(phase)),
        path.slope + size * rate * np.cos(turned),
    )


def _drum_eccentricity(path: Path, at: At, values: Values) -> Path:
    return _with_wave(path, values["eccentricity"], at.drum_angle, values["phase"], 1.0)


DRUM_ECCENTRICITY = Effect(
    id="drum-eccentricity",
    stage=Stage.WOUND,
    parameters=(
        Parameter(
            "eccentricity",
            "m",
            null=0.0,
            typical=2e-4,
            low=0.0,
            high=0.02,
            plausible=Plausible(
                0.0,
                0.1,
                "a drum that runs out by a tenth of its radius is bent",
                of="drum.winding_radius",
            ),
        ),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=_drum_eccentricity,
    outputs=("cable_length", "motor_torque"),
    variable="drum_angle",
    what="The drum's axis is not the axis of its surface.",
    formula="W + e (sin(φ − φ0) + sin φ0)",
    source="geometry of an eccentric circle, first order in e",
    looks_like="A sine once per drum turn in length, and in torque in proportion to the load.",
    confused_with=("gear-transmission-error",),
    told_apart="Two loads: the torque's sine grows with the load. A ratio that is not whole.",
    polar=("eccentricity", "phase"),
    on_robot=frozenset({"one"}),
)


def _drum_roundness(path: Path, at: At, values: Values) -> Path:
    lobes = values["lobes"]
    return _with_wave(path, values["amplitude"], lobes * at.drum_angle, values["phase"], lobes)


_LOBES = 2.0, 3.0, 4.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0
"""Oval drums, jaws of a chuck, drums of bars: neighbours are no start for each other. Five is the
example of an effect of one's own (docs/howto/effect.md)."""

DRUM_ROUNDNESS = Effect(
    id="drum-roundness",
    stage=Stage.WOUND,
    parameters=(
        Parameter(
            "amplitude",
            "m",
            null=0.0,
            typical=2e-4,
            low=0.0,
            high=0.02,
            plausible=Plausible(
                0.0,
                0.1,
                "a drum that is out of round by a tenth of its radius is no drum",
                of="drum.winding_radius",
            ),
        ),
        Parameter("phase", "rad", null=0.0, typical=1.0),
        Parameter(
            "lobes",
            "1",
            null=2.0,
            typical=2.0,
            low=2.0,
            high=12.0,
            role="shape",
            grid=_LOBES,
            whole=True,
        ),
    ),
    apply=_drum_roundness,
    outputs=("cable_length", "motor_torque"),
    variable="drum_angle",
    what="The drum is out of round: oval, or with three or more lobes.",
    formula="W + a (sin(k φ − p) + sin p), k lobes per drum turn",
    source="ISO 12181-1, roundness: undulations per revolution; first order in a",
    looks_like="A sine two or more times per drum turn, in torque in proportion to the load.",
    confused_with=("drum-eccentricity", "gear-transmission-error"),
    told_apart="Two loads: the torque's sine grows with the load. A ratio that is not whole.",
    polar=("amplitude", "phase"),
)


def _pulley_eccentricity(path: Path, at: At, values: Values) -> Path:
    """A pulley that is missing is round."""
    pulleys, number = at.profile.pulley, int(values["pulley"])
    if number > len(pulleys):
        return path
    radius, size = pulleys[number - 1].radius, values["amplitude"]
    return _with_wave(path, size, path.value / radius, values["phase"], path.slope / radius)


PULLEY_ECCENTRICITY = Effect(
    id="pulley-eccentricity",
    stage=Stage.WOUND,
    parameters=(
        Parameter("amplitude", "m", null=0.0, typical=2e-4, low=0.0, high=0.02),
        Parameter("phase", "rad", null=0.0, typical=1.0),
        Parameter(
            "pulley",
            "1",
            null=1.0,
            typical=1.0,
            low=1.0,
            high=12.0,
            role="shape",
            grid=(1.0, 2.0, 3.0),
            whole=True,
        ),
    ),
    apply=_pulley_eccentricity,
    outputs=("cable_length", "motor_torque"),
    part="pulley",
    variable="cable_length",
    what="The axis of a pulley is not that of its groove.",
    formula="W + a (sin(W/R − p) + sin p), R the radius of the pulley with this number",
    source="geometry of an eccentric circle, first order in the amplitude",
    looks_like="A sine over the length with the pulley's circumference as its period.",
    confused_with=("drum-eccentricity", "drum-roundness", "gear-transmission-error"),
    told_apart="The period: a turn of the pulley, not of the drum or motor.",
    needs=("pulley",),
    order=1,
    polar=("amplitude", "phase"),
)

_TURN = 2 * np.pi


def _guide_offset(path: Path, at: At, values: Values) -> Path:
    """Wound length plus the detour by the guide √(h² + x²) − h, x = x0 + m Φ/2π."""
    guide = at.profile.guide
    if guide is None:
        return path
    per_radian = values["mismatch"] / _TURN
    aside = values["offset"] + per_radian * at.wound_angle
    reach = np.hypot(guide.distance, aside)
    return Path(path.value + (reach - guide.distance), path.slope + per_radian * aside / reach)


GUIDE_OFFSET = Effect(
    id="guide-offset",
    stage=Stage.WOUND,
    parameters=(
        Parameter("offset", "m", null=0.0, typical=0.01, low=-0.3, high=0.3),
        Parameter("mismatch", "m", null=0.0, typical=1e-3, low=-0.02, high=0.02),
    ),
    apply=_guide_offset,
    outputs=("cable_length", "motor_torque"),
    part="guide",
    variable="cable_length",
    what="The guide is mounted with an offset, or its lead differs from the groove pitch.",
    formula="ℓ − (√(h² + (x0 + m Φ/2π)²) − h), h = guide.distance, m per turn",
    source="Pythagoras; cable-winding device, section on the guide",
    looks_like="A parabola of the length error over the travel of the guide.",
    confused_with=("layer-thickness", "drum-radius", "gear-ratio"),
    told_apart="Shift the guide by a known amount; or the torque at constant weight.",
    needs=("guide",),
    order=1,
    probes=(
        {"mismatch": 1e-3},
        {"offset": 0.01, "mismatch": 1e-3},
        {"offset": -0.02, "mismatch": 1e-3},
        {"offset": 0.1, "mismatch": 1e-3},
    ),
    on_robot=frozenset({"one"}),
)
