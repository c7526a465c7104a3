"""Quantity that the name of a column stands for, in English, German, French, Spanish and Italian.

The rules are ordered: the first one that matches decides. Abbreviations follow CiA 402, robotics
(q, dq, tau) and the recorders of common drives.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from functools import cache

from winchkit.runs.columns import column_dimension
from winchkit.runs.importing.units.spelling import read_unit, split_unit
from winchkit.schema.linear_axis import CHANNELS, ROTARY

IGNORED = ""
"""Channel of a set point, an error, a status word: known and not used."""
CURRENT = "current"
"""Channel of a motor current, which gives the torque."""


@dataclass(frozen=True)
class NamedChannel:
    """Channel that a name stands for."""

    channel: str
    """Empty where the column is not used."""
    rank: int
    """1 for the name of the channel itself, larger for weaker hints."""
    text: str
    """Part of the name that decided."""


_NO_MOTOR = r"(?!.*\b(motor\w*|mot|rotor|drum|winch|drive|servo|encoder|axis)\b)"
_CRANE = (
    rf"^{_NO_MOTOR}.*\b(boom|jib|sway|swing|slew|slewing|luff|luffing|tilt|inclination|fleet|wrap|"
    r"rudder|payload|hook|ausleger|pendel\w*|neigungs?\w*|schwenk\w*)\b.*"
    r"\b(angles?|pos|positions?|\w*winkel)\b|\b(pendel|neigungs|ausleger|schwenk)winkel\b"
)
"""Angles and positions of a crane's boom or load, of a vessel, of a cable at its drum."""
_JOINT = (
    rf"^{_NO_MOTOR}.*\b(knee|ankle|hip|elbow|wrist|shoulder|finger|pendulum|arm|knie\w*)\b.*"
    r"\b(angles?|pos|positions?|\w*winkel)\b"
)
"""Angles of a joint, which a cable or a gearbox may separate from the motor."""
_NOT_USED = (
    # Set points, predictions and errors.
    r"\b(soll\w*|\w+soll|target|tar(?= (pos|vel|tor|cur|ang|spe))|set ?points?|"
    r"set (?=pos|vel|tor|cur|ang|spe)|"
    r"sp|cmd|cmptd|computed|commande?d?|demand(ed)?|desired|des|"
    r"model|predicted|prediction|rnea|inverse dynamics|"
    r"reference|ref|consigne|consigna|goal|planned|feed ?forward|"
    r"vorgabe|fuhrungs\w*|profile|offset|"
    r"limit\w*)\b",
    r"\b(error|err|diff|difference|fehler|regelabweichung|schlepp\w*|following|erreur|deviation|abweichung|"
    r"residual|mean error|std|stddev|variance|covariance|droop)\b",
    # Constants of a device, the wind, and angles of what is no motor.
    r"\b(constants?|gain|stiffness|inertia|angle of attack|aoa|wind|wind ?speed|"
    r"windgeschwindigkeit|\w*wind ?speed|latitude|longitude|altitude|azimuth|elevation|"
    r"east|north|south|west|easting|northing|ang(le|ular) increments?|"
    r"(cable|r[o]pe|wire|tether|line|hook|load|trolley|platform|reel ?out|reel ?in)"
    r" ?(reel ?out |reel ?in )?(speed|velocity))\b",
    # Components of an acceleration, a twist or a magnetic field: no position.
    r"^(?!.*\b(position|pos|translation|orientation|rotation)\b).*"
    r"\b(acceleration|accel\w*|acc|gyro\w*|gravity|magnetic|magnetometer|mag|twist|"
    r"linear|angular)\b.* [xyz]$",
    # Quantities of the tool of a robot; its components by number are no joints.
    r"\btcp\b|\b(ee|eef|end ?effector|tool)\b.* \d$",
    # Torques of what the motor drives: of a brake on a test bench, of the load.
    r"\b(brake|absorber|load|external|ext|brems\w*)( \w+)? (torques?|moments?)\b",
    r"\b(brems|last)(dreh)?moment\b",
    _CRANE,
    r"\b(theta|phi|q|x|y|z) ?(ddot|dot dot|double ?dot)\b|\bdd(theta|phi|q)\b",
    r"^pulses?$",
    # States and counters.
    r"^(frame|sub ?frame|index|idx|nr|no|number|sample|samples|counter|count|row|"
    r"zeile|status|state|"
    r"status ?word|control ?word|mode|modes|flags?|seq|sequence|comment|comments|kommentar|id|"
    r"event|trigger|marker|quality|valid|time ?code)( \d+)?$",
)
_RULES: tuple[tuple[str, int, str], ...] = (
    *((pattern, 1, IGNORED) for pattern in _NOT_USED),
    (r"^(date|datum|fecha|data|jour|day|tag|local date|recording date)$", 1, "date"),
    # Time.
    (
        r"^(time|t|zeit|temps|tiempo|tempo|timestamps?|time stamps?|zeitstempel|x value|"
        r"uhrzeit|clock|"
        r"stamp|sec|secs|seconds|sekunden|date ?time|datum uhrzeit|date heure|heure|hora|log time|"
        r"elapsed( time)?|elapsed seconds|sim time|rel ?time|relative time|abs ?time|"
        r"local time|messzeit|"
        r"zeit \d.*|time \d.*|t \d|tid|ora|date time|datum zeit|millis|micros|header stamp)$",
        1,
        "time",
    ),
    (r"^(time|zeit|temps|tiempo)\b|\b(time ?stamps?|zeitstempel)\b", 2, "time"),
    (r"\b(time|zeit)$", 3, "time"),
    # Temperature before force: "cell temperature".
    (r"\b(temperaturs?|temperatures?|temp|temperatura|\w*temperatur|tmp)\b", 1, "temperature"),
    # Poses of a platform.
    *(
        (
            rf"\b(q ?{axis}|(quat\w*|rotation|orientation) {axis}|{axis} quat\w*)\b",
            1,
            f"platform_q{axis}",
        )
        for axis in "wxyz"
    ),
    *(
        (
            rf"^(r{axis}|rot ?{axis}|a r{axis}|euler {axis}|rvec {axis})$|\b{name}\b",
            1,
            f"platform_{name}",
        )
        for axis, name in (("x", "roll"), ("y", "pitch"), ("z", "yaw"))
    ),
    *(
        (
            rf"^({axis}|p{axis}|pos(ition)? {axis}|{axis} pos(ition)?|t(vec ?)?{axis}|"
            rf"{axis} coord\w*|.* position {axis}|translation {axis})$",
            1,
            f"platform_{axis}",
        )
        for axis in "xyz"
    ),
    # Forces and lengths of the cable.
    (
        r"\b(cable|r[o]pe|wire|line|tendon|seil\w*|string) ?(length|lange|lenght)\b|\bseillange\b|"
        r"\b(longueur|longitud|lunghezza) (du |de |del )?(cable|cuerda|fune)\b",
        1,
        "cable_length",
    ),
    (
        r"\b(load|platform|hook|last|haken|end) ?(force|kraft|side force)\b|\blastkraft\b|"
        r"\bhakenlast\b|\b(hook|suspended) ?load\b|\bfuerza de carga\b",
        1,
        "load",
    ),
    (
        r"\b(tensions?|cable forces?|r[o]pe forces?|line pull|seilkraft\w*|seilzugkraft|zugkraft|"
        r"seilspannung|tracci?on|tension|load ?cells?|kraftmessdose|kmd|kraftaufnehmer|dynamometer|"
        r"loadcell|lc\d*)\b",
        1,
        "tension",
    ),
    # Motor: velocity and torque before position, whose words are the most general.
    (
        r"\b(velocity|velocities|velocite|velo?|speeds?|drehzahl\w*|\w+drehzahl|geschwindigkeit\w*|"
        r"\w+geschwindigkeit|winkelgeschwindigkeit|omega|vitesse|velocidad|velocita|dq|qd|qdot|"
        r"dtheta|thetadot|(theta|phi|q) dot|phidot|dphi|"
        r"rpm|n ist|nist|v ist|vist|vx|angular rate|rotational speed)\b",
        1,
        "motor_velocity",
    ),
    (
        r"\b(torques?|torq|tor|drehmoment\w*|\w+drehmoment|moment\w*|\w+moment|couple|par|coppia|tau|trq|"
        r"effort|m ist|mist|motormoment)\b",
        1,
        "motor_torque",
    ),
    # An effort of a joint; an efficiency is of no joint and has no number.
    (
        r"^eff (.*\d$|joint\b|(left|right|knee|hip|ankle|elbow|wrist|shoulder)\b)",
        2,
        "motor_torque",
    ),
    (
        r"\b(currents?(?! (encoder|pos|angle|length|reading|tension|force|load))|"
        r"strom\w*|\w+strom|istrom|courant|corriente|corrente|iq|i q|"
        r"amperage|curr?|i ist|"
        r"motor i|phase current)\b",
        2,
        CURRENT,
    ),
    (_JOINT, 3, "motor_angle"),
    (
        r"\b(motor ?angles?|mot(or)? ?(pos(ition)?|angle)|motorwinkel|motorposition|rotor\w*|"
        r"theta|phi|enc|encoder\w*|geber\w*|drehgeber|resolver|angles?|\w*winkel\w*|angulo|angolo|q|qm|px)\b",
        1,
        "motor_angle",
    ),
    (
        r"\b(positions?|pos|\w*position|lage\w*|\w*lage|istposition|posicion|posizione|"
        r"pos estimate)\b",
        2,
        "motor_angle",
    ),
    (
        r"\b(forces?|frc|kraft\w*|\w+kraft|fuerza|forza|effort de traction|f|fz|cell|"
        r"zelle|cellule)\b",
        2,
        "tension",
    ),
    (r"\b(load|last|charge|carga|carico|gewicht|weight)\b", 3, "tension"),
    (
        r"\b(length|lange|longueur|longitud|lunghezza|draw ?wire|seilzug\w*|distance|"
        r"abstand|weg|wegstrecke|"
        r"displacement|disp|stroke|hub|laser|extension)\b",
        2,
        "cable_length",
    ),
    (r"\bswivel\b|\bschwenkwinkel\b", 1, "swivel"),
    # Beside the word of another quantity it is a winch: W1 position.
    (r"\bw\b", 1, "motor_velocity"),
)
_COMPILED = tuple((re.compile(pattern), rank, channel) for pattern, rank, channel in _RULES)
_LONGEST = 300
"""Characters of a name that are read."""
_GREEK = {
    **{"ß": "ss", "θ": " theta ", "ϑ": " theta ", "φ": " phi ", "ϕ": " phi ", "α": " angle "},
    **{"ω": " omega ", "Ω": " omega ", "τ": " tau ", "Θ": " theta ", "Φ": " phi "},
}
_CAMEL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|(?<=[A-Za-z])(?=\d)")
_MATRIX = re.compile(r"^(?:.* )?(?:r|rot|m|matrix|t) ?([123]) ?([1234])$")


@cache
def words_of(name: str) -> str:
    """A name in lower case without accents: ``MotorPos_ist2`` becomes ``motor pos ist 2``."""
    text = _CAMEL.sub(" ", "".join(_GREEK.get(char, char) for char in name[:_LONGEST]))
    text = unicodedata.normalize("NFKD", text)
    text = "".join(char for char in text if not unicodedata.combining(char)).lower()
    return " ".join(re.split(r"[^a-z0-9]+", text)).strip()


def meaning_of(name: str, labels: tuple[str, ...] = ()) -> NamedChannel | None:
    """Channel that a name without unit stands for (:data:`IGNORED`: none); None if unknown."""
    # "position" and "force" are words of any recorder, and no names of channels alone.
    is_word = name.rpartition(".")[2] in ROTARY
    if (column_dimension(name) is not None and not is_word) or name == "time":
        return NamedChannel(name, 0, name)
    words = words_of(name)
    if matrix := _MATRIX.match(words):
        row, column = int(matrix[1]), int(matrix[2])
        channel = f"platform_{'xyz'[row - 1]}" if column == 4 else f"platform_r{row}{column}"
        return NamedChannel(channel, 1, name)
    whole = words_of(" ".join((*labels, name)))
    # The last part of a name with dots or slashes (MAT, HDF5, ROS), where the whole says nothing.
    last = words_of(re.split(r"[./]", name)[-1])
    # The device of a process variable is before its quantity: TARGET:PosAct is no set point.
    variable = words_of(name.rpartition(":")[2])
    for text in dict.fromkeys((_axis_of(labels, words), variable, words, whole, last)):
        for pattern, rank, channel in _COMPILED:
            if text and (found := pattern.search(text)):
                return NamedChannel(channel, rank, found[0])
    return None


def name_and_unit(text: str, given: str = "") -> tuple[str, str]:
    """Name and unit of a cell, whose unit in a row of its own, if any, is ``given``.

    A length or a time behind the name of another quantity is an index: ``tau_m`` is the torque of
    a motor, ``speed_s`` a smoothed speed. So is one beside another unit in the row.
    """
    name, unit = split_unit(text)
    known, stated = read_unit(unit), read_unit(given)
    is_behind = text.strip() == f"{name}_{unit}"
    if not is_behind or known is None or known.dimension not in {"length", "time"}:
        return name, unit or (given if stated else "")
    if stated is not None:
        return (name if stated.dimension == known.dimension else text.strip()), given
    meaning = meaning_of(name)
    if meaning is None:
        is_index = unit == "m"  # of a motor, or measured: no evidence of a length
    else:
        # A position may be a length; what is called an angle is none.
        linear = CHANNELS.get(meaning.channel, "") if meaning.rank > 1 else ""
        fitting = {column_dimension(meaning.channel), column_dimension(linear)}
        is_index = bool(meaning.channel) and known.dimension not in fitting
    return (text.strip(), "") if is_index else (name, unit)


def _axis_of(labels: tuple[str, ...], words: str) -> str:
    """``rotation x`` of a tracker's column ``X`` below ``Rotation``."""
    above = words_of(" ".join(labels))
    if "quaternion" in above and words in {"rx", "ry", "rz", "rw"}:
        return f"rotation {words[1]}"
    if words not in {"x", "y", "z", "w"}:
        return ""
    if "rotation" in above or "quaternion" in above or "orientation" in above:
        return f"rotation {words}"
    return f"position {words}" if words != "w" else "rotation w"
