"""Effects in words: a name for lists and the clause that says what is missing."""

from __future__ import annotations

EFFECTS: dict[str, tuple[str, str]] = {
    "anchor-point": (
        "anchor point of the cable",
        "the anchor point of the cable differs from the profile",
    ),
    "cable-creep": ("creep of the cable", "the cable creeps under load"),
    "cable-elongation-exponential": (
        "exponential elongation of the cable",
        "the cable is elastic and stiffens with its tension",
    ),
    "cable-elongation-linear": ("elongation of the cable", "the cable is elastic"),
    "cable-elongation-quartic": (
        "quartic elongation of the cable",
        "the cable is elastic with a nonlinear law",
    ),
    "cable-hysteresis": ("hysteresis of the cable", "the cable is elastic with hysteresis"),
    "cable-sag": ("sag of the cable", "the cable sags under its own weight"),
    "cable-thermal": ("thermal expansion of the cable", "the cable expands with its temperature"),
    "cable-weight": ("weight of the cable", "the weight of the cable is not negligible"),
    "cell-clipping": ("saturation of the load cell", "the reading of the load cell saturates"),
    "cell-creep": ("creep of the load cell", "the load cell creeps"),
    "cell-crosstalk": (
        "crosstalk from torque to load cell",
        "the load cell reads a share of the motor torque",
    ),
    "cell-drift": ("drift of the load cell", "the zero of the load cell drifts with time"),
    "cell-gain": ("span of the load cell", "the span of the load cell is wrong"),
    "cell-hysteresis": ("hysteresis of the load cell", "the load cell has hysteresis"),
    "cell-lag": ("delay of the load cell", "the reading of the load cell is delayed"),
    "cell-nonlinearity": (
        "nonlinearity of the load cell",
        "the sensitivity of the load cell depends on the load",
    ),
    "cell-offset": ("zero of the load cell", "the zero of the load cell is wrong"),
    "cell-thermal": (
        "thermal drift of the load cell",
        "the zero of the load cell depends on the temperature",
    ),
    "drum-eccentricity": ("runout of the drum", "the drum has runout"),
    "drum-roundness": ("roundness of the drum", "the drum is out of round"),
    "drum-unbalance": ("unbalance of the drum", "the drum is unbalanced"),
    "drum-radius": ("winding radius of the drum", "the winding radius of the drum is wrong"),
    "exit-point": (
        "exit point of the cable",
        "the exit point of the cable differs from the profile",
    ),
    "home-length": ("cable length at home", "the cable length at home differs from the profile"),
    "tracker-delay": ("delay of the tracker", "the tracker is delayed against the bench"),
    "tracker-frame": ("frame of the tracker", "the tracker stands in another frame"),
    "tracker-scale": ("scale of the tracker", "the tracker's metre is wrong"),
    "reflector-offset": (
        "place of the reflector",
        "the reflector is at another place of the platform",
    ),
    "imu-mounting": (
        "mounting of the target or IMU",
        "the axes of the target or IMU are turned on the platform",
    ),
    "payload-centre": (
        "centre of mass of the platform",
        "the centre of mass of the platform is wrong",
    ),
    "payload-mass": ("mass of the platform", "the mass of the platform is wrong"),
    "swivel-radius": ("radius of the swivel pulley", "the radius of the swivel pulley is wrong"),
    "drum-winding-tension": (
        "strain of the cable on the drum",
        "the cable on the drum keeps the strain of its winding",
    ),
    "encoder-slip": ("slip of the drum's encoder", "the drum slipped against its encoder"),
    "load-viscous": ("viscous friction of the load", "the load has viscous friction in its guide"),
    "load-coulomb": ("Coulomb friction of the load", "the load has Coulomb friction in its guide"),
    "load-friction-at-place": (
        "friction of the load at one position",
        "the load has more friction at one position",
    ),
    "friction-at-place": (
        "friction at one position",
        "the motor side has more friction at one position",
    ),
    "friction-of-load": (
        "friction in proportion to the load",
        "the motor side has friction in proportion to the load",
    ),
    "friction-of-torque": (
        "friction in proportion to the torque",
        "the motor side has friction in proportion to the motor torque",
    ),
    "friction-of-transmission": (
        "friction in proportion to weight and inertia",
        "the motor side has friction in proportion to the torque of weight and inertia",
    ),
    "friction-growth": (
        "change of the friction with time",
        "the Coulomb friction of the motor side changes with time",
    ),
    "frame-compliance": ("compliance of the frame", "the frame is compliant"),
    "gear-backlash": ("backlash of the gearbox", "the gearbox has backlash"),
    "gear-dahl": (
        "presliding friction of the gearbox",
        "the gearbox has presliding friction in proportion to the load (Dahl)",
    ),
    "gear-efficiency": ("losses of the gearbox", "the gearbox loses torque by friction"),
    "gear-ratio": ("gear ratio", "the gear ratio is wrong"),
    "gear-transmission-error": (
        "transmission error of the gearbox",
        "the gearbox has a periodic transmission error",
    ),
    "guide-offset": ("offset of the cable guide", "the guide is mounted with an offset"),
    "joint-gravity": ("eccentric weight of the axis", "the axis carries an eccentric weight"),
    "joint-payload": ("payload on the axis", "the stated load acts on a lever of the axis"),
    "layer-thickness": ("growth of the cable layers", "the growth of the cable layers is wrong"),
    "length-gain": ("gain of the length instrument", "the length instrument has a gain error"),
    "load-gain": ("stated load", "the load differs from the one that the runs state"),
    "load-offset": ("mass beside the stated load", "the load is heavier by a mass not stated"),
    "length-time-offset": ("delay of the length instrument", "the length instrument is delayed"),
    "load-lever": ("lever of the load", "the load acts through a lever"),
    "motor-cogging": ("cogging of the motor", "the motor has cogging torque"),
    "motor-coulomb": ("Coulomb friction of the motor", "the motor side has Coulomb friction"),
    "motor-coulomb-asymmetry": ("offset of the torque signal", "the torque signal has an offset"),
    "motor-dahl": (
        "presliding friction of the motor",
        "the motor side has presliding friction (Dahl)",
    ),
    "motor-stribeck": (
        "Stribeck friction of the motor",
        "the friction of the motor side is higher at low speed (Stribeck)",
    ),
    "motor-viscous": ("viscous friction of the motor", "the motor side has viscous friction"),
    "motor-viscous-asymmetry": (
        "viscous friction by direction",
        "the viscous friction of the motor side depends on the direction",
    ),
    "prediction-delay": (
        "time shift of the predicted torque",
        "the predicted torque is shifted in time",
    ),
    "pulley-capstan": (
        "capstan friction at a pulley",
        "the cable slides around a blocked pulley (capstan friction)",
    ),
    "pulley-eccentricity": ("runout of a pulley", "the groove of a pulley has runout"),
    "pulley-coulomb": ("Coulomb friction of the pulleys", "the pulleys have Coulomb friction"),
    "pulley-dahl": (
        "presliding friction of the pulleys",
        "the pulleys have presliding friction (Dahl)",
    ),
    "pulley-inertia": ("inertia of the pulleys", "the inertia of the pulleys is not negligible"),
    "pulley-stribeck": (
        "Stribeck friction of the pulleys",
        "the pulleys have Coulomb friction with a Stribeck curve",
    ),
    "pulley-viscous": ("viscous friction of the pulleys", "the pulleys have viscous friction"),
    "rotor-inertia": ("inertia of the motor", "the inertia on the motor side is not negligible"),
    "spring-balancer": (
        "spring or weight on the axis",
        "the torque is linear in the position (a spring or a weight)",
    ),
    "stribeck-of-load": (
        "Stribeck friction of the load",
        "the friction in proportion to the load is higher at low speed",
    ),
    "torque-constant": (
        "torque constant of the drive",
        "the torque constant of the drive is wrong",
    ),
    "torque-saturation": (
        "saturation of the motor",
        "the torque constant of the motor falls with the current",
    ),
    "torque-lag": (
        "low-pass of the torque signal",
        "the torque signal of the drive is delayed by a low-pass",
    ),
    "torque-ripple": (
        "ripple of the torque constant",
        "the torque constant depends on the rotor position",
    ),
    "torque-lead": (
        "time shift of the torque signal",
        "the torque signal is shifted in time",
    ),
    "viscous-thermal": (
        "temperature of the viscous friction",
        "the viscous friction of the motor side depends on the temperature",
    ),
}
"""Name and clause by id."""
