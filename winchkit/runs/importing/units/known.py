"""Spellings of units: ``1/min``, ``U/min``, ``°``, ``Nm``, ``Inkr``, ``mV/V``, ``ozf·in``.

A spelling has a dimension and the SI value of one unit. Units without an SI value of their own have
dimensions of this module: counts of an encoder, a share of the rated torque, a bridge's mV/V. Those
of torques and speeds are composed: a force by a length, an angle or a length by a time.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from winchkit.units import GRAVITY, UNITS

COUNTS, COUNT_RATE, SHARE, BRIDGE = "counts", "counts per second", "share", "bridge"


@dataclass(frozen=True)
class SpelledUnit:
    """A unit: SI value = factor × number + offset."""

    text: str
    """Spelling of winchkit where it has the unit, else that of the file."""
    dimension: str
    factor: float
    offset: float = 0.0


_TURN = 2 * math.pi
_DEG = math.pi / 180
_LB = 0.45359237 * GRAVITY
_INCH = 0.0254
_FOOT_POUND = _LB * 12 * _INCH
_FOREIGN: dict[str, dict[float, str]] = {
    "angle": {
        _TURN: "turns rev revs revolution revolutions U Umdr Umdrehung Umdrehungen tr tour tours "
        "vuelta vueltas giri rot rotation rotations cycles",
        _DEG: "° º degs degree degrees Grad Altgrad degre degres grado grados gradi",
        1.0: "radian radians Radiant",
        _TURN / 400: "gon gons gradian gradians",
        1e-6: "urad",
        _DEG * 1e-3: "mdeg",
        _DEG / 60: "arcmin",
        _DEG / 3600: "arcsec",
    },
    "angular speed": {
        _TURN / 60: "1/min min-1 /min U/min Umin r/min rev/min tr/min turn/min turns/min g/min "
        "giri/min RPM Upm mot-rpm",
        _TURN: "turn/s turns/s rev/s revs/s rps U/s r/s tr/s",
        _DEG: "°/s º/s degs/s deg/sec degree/s degrees/s Grad/s dps",
        1.0: "rad/sec rads/s radian/s radians/s rads-1 1/s s-1",
        _TURN / 60e3: "mrpm",
        _TURN * 1e3 / 60: "krpm",
    },
    "torque": {
        1.0: "Newtonmeter newton-meter newton-meters",
        _FOOT_POUND: "foot-pound foot-pounds pound-foot pound-feet",
        _FOOT_POUND / 12: "inch-pound inch-pounds pound-inch",
        _FOOT_POUND / 192: "inch-ounce inch-ounces ounce-inch",
    },
    "force": {
        1.0: "Newton Newtons",
        10.0: "daN",
        1e-2: "cN",
        1e-6: "uN",
        1e6: "MN",
        GRAVITY: "kgf kp",
        GRAVITY * 1e-3: "gf p",
        _LB: "lbf lb lbs pound pounds",
        1e3 * _LB: "kip kips klbf klb",
        _LB / 16: "ozf oz",
    },
    "mass": {1.0: "Kilogramm kilogram kilograms kilos", 1e-3: "Gramm gram grams gr"},
    "length": {
        1.0: "meter meters metre metres Meter",
        1e-3: "millimeter millimeters millimetre millimetres",
        1e-2: "centimeter centimeters centimetre centimetres",
        0.1: "dm",
        1e-6: "micrometer micron microns",
        _INCH: "in inch inches ''",
        12 * _INCH: "ft foot feet",
    },
    "speed": {1e-3 / 60: "mm/min", 1 / 3.6: "km/h"},
    "time": {
        1.0: "sec secs second seconds Sek Sekunde Sekunden seconde secondes segundo segundos",
        1e-3: "msec msecs millisec millisecs millisecond milliseconds Millisekunden",
        1e-6: "usec usecs microsec microsecs microsecond microseconds",
        1e-7: "100ns",
        1e-9: "ns nsec nanosecond nanoseconds",
        60.0: "minute minutes Minuten",
        3600.0: "hr hrs hour hours Std Stunden",
        86400.0: "d day days Tage",
    },
    "current": {
        1.0: "Ampere Amp Amps ampere amperes Aeff Arms A_rms A_eff",
        1e-3: "mAeff mArms",
        1e-6: "uA",
        1e3: "kA",
    },
    "voltage": {1.0: "Volt Volts volts"},
    "temperature": {1.0: "°C ºC C Celsius celsius °Celsius"},
    COUNTS: {
        1.0: "count counts cnt cnts ct inc incs incr Ink Inkr Inkremente increments tick ticks "
        "pulse pulses qc digit digits LSB Imp Impulse steps puls ppr"
    },
    COUNT_RATE: {1.0: "counts/s cnt/s inc/s Inkr/s ticks/s qc/s pulses/s counts/sec cts/s"},
    SHARE: {
        1e-2: "% percent Prozent pct prozent porcent",
        1e-3: "‰ permille Promille per-thousand perthousand 1/1000 0.1% %o",
    },
    BRIDGE: {1.0: "mV/V", 1e-3: "uV/V"},
}
_OTHER_OFFSET = {
    "F": SpelledUnit("°F", "temperature", 5 / 9, -160 / 9),
    "K": SpelledUnit("K", "temperature", 1.0, -273.15),
}
_FORCES: dict[str, dict[str, float]] = {
    "m mm cm": {
        **{"N": 1.0, "kN": 1e3, "MN": 1e6, "mN": 1e-3, "uN": 1e-6, "nN": 1e-9},
        **{"cN": 1e-2, "dN": 0.1, "daN": 10.0, "dyn": 1e-5},
        **dict.fromkeys(("kgf", "kp", "kg"), GRAVITY),
    },
    "cm mm": {"gf": GRAVITY * 1e-3, "p": GRAVITY * 1e-3},
    "cm": {"g": GRAVITY * 1e-3},
    "in inch ft": {
        **dict.fromkeys(("lbf", "lb", "lbs"), _LB),
        **dict.fromkeys(("ozf", "oz"), _LB / 16),
        **dict.fromkeys(("kip", "klbf"), 1e3 * _LB),
    },
}
"""Forces of which a length makes a torque, by these lengths; lbm, gm and tm are masses."""
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": _INCH, "inch": _INCH, "ft": 12 * _INCH}
_REVERSED = ("in", "inch", "ft")
"""Lengths that are also written before the force; ``mN`` is none."""
_ANGLES = {
    **dict.fromkeys(("rev", "revs", "turn", "turns", "rot", "U", "tr", "r"), _TURN),
    **dict.fromkeys(("deg", "degs", "°", "º", "degree", "degrees"), _DEG),
    **{"rad": 1.0, "rads": 1.0, "radian": 1.0, "radians": 1.0, "gon": _TURN / 400},
    **{"mrad": 1e-3, "urad": 1e-6, "krad": 1e3, "mdeg": _DEG * 1e-3},
    **{"arcmin": _DEG / 60, "arcsec": _DEG / 3600},
}
_WAYS = {
    **{"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "km": 1e3},
    **{"in": _INCH, "inch": _INCH, "inches": _INCH, "ft": 12 * _INCH, "feet": 12 * _INCH},
}
_COUNTS = [
    "count",
    "counts",
    "cnt",
    "cnts",
    "cts",
    "ct",
    "inc",
    "incs",
    "Ink",
    "Inkr",
    "tick",
    "ticks",
    "qc",
    "pulse",
    "pulses",
    "LSB",
]
_TIMES = {"s": 1.0, "min": 60.0, "h": 3600.0, "ms": 1e-3}
_DROPPED = re.compile(r"[\s·⋅∙‧・*×•^_.]")
_EXPONENTS = str.maketrans("⁻−¹²³", "--123")
_PER = (
    (re.compile(r"(?<=[^\W\d])[\s_]*\bper\b[\s_]*|(?<=[^\W\d])_per_"), "/"),
    (re.compile(r"/\s*(sec|secs|second|seconds|Sek|Sekunde)$"), "/s"),
    (re.compile(r"/\s*(minute|minutes|Minute)$"), "/min"),
    (re.compile(r"(?<=[^\W\d]|[°º])[\s·⋅∙*.^]*(?<![A-Za-z])(s|min|h|ms)\^?-1$"), r"/\1"),
    (re.compile(r"^(?!in_)([^\W_]+)_(s|sec|min)$"), r"\1/\2"),
)
"""Spellings of a rate: ``deg per sec``, ``rad s⁻¹``, ``rad_s`` of names that have no slash."""
_TWO_QUANTITIES = {"kn", "nm"}
"""In small letters: knots beside kN, nanometres beside N m."""
_AMBIGUOUS = {"grad", "tm"}
"""Without regard to case these are of two units: Grad and gradian."""


def _key(text: str) -> str:
    """A spelling without blanks, dots and signs of multiplication."""
    plain = text.strip().replace("µ", "u").replace("μ", "u").translate(_EXPONENTS)
    return re.sub(r"(?<=[A-Za-z])-(?=[A-Za-z])", "", _DROPPED.sub("", plain))


def _rate(text: str) -> str:
    """A spelling with a slash before its time, where it is a rate."""
    plain = text.strip().translate(_EXPONENTS)
    for pattern, by in _PER:
        plain = pattern.sub(by, plain)
    return plain


def _composed() -> Iterator[SpelledUnit]:
    """Torques and speeds."""
    for lengths, forces in _FORCES.items():
        for length in lengths.split():
            for force, newtons in forces.items():
                value = newtons * _LENGTHS[length]
                yield SpelledUnit(f"{force} {length}", "torque", value)
                if length in _REVERSED:
                    yield SpelledUnit(f"{length} {force}", "torque", value)
    for time, seconds in _TIMES.items():
        for angle, value in _ANGLES.items():
            yield SpelledUnit(f"{angle}/{time}", "angular speed", value / seconds)
        for way, value in _WAYS.items():
            yield SpelledUnit(f"{way}/{time}", "speed", value / seconds)
        for counts in _COUNTS:
            yield SpelledUnit(f"{counts}/{time}", COUNT_RATE, 1 / seconds)


def _known() -> dict[str, SpelledUnit]:
    found: dict[str, SpelledUnit] = {}
    ours = (
        *("angle", "angular speed", "torque", "force", "mass", "length", "speed", "time"),
        *("current", "voltage", "temperature"),
    )
    for dimension in ours:
        for unit, value in UNITS[dimension].items():
            found[_key(unit)] = SpelledUnit(unit, dimension, value)
    spelled = [
        SpelledUnit(word, dimension, value)
        for dimension, spellings in _FOREIGN.items()
        for value, words in spellings.items()
        for word in words.split()
    ]
    for other in (*spelled, *_composed()):
        table = UNITS.get(other.dimension, {})
        same = (name for name, size in table.items() if math.isclose(size, other.factor))
        found.setdefault(_key(other.text), replace(other, text=next(same, other.text)))
    for word in ("F", "°F", "degF", "Fahrenheit"):
        found[_key(word)] = _OTHER_OFFSET["F"]
    for word in ("K", "Kelvin"):
        found[_key(word)] = _OTHER_OFFSET["K"]
    return found


_KNOWN = _known()


def _folded() -> dict[str, SpelledUnit]:
    """Units by their spelling in small letters, where that is of one unit only."""
    found: dict[str, list[SpelledUnit]] = {}
    for key, unit in _KNOWN.items():
        found.setdefault(key.casefold(), []).append(unit)
    return {
        key: units[0]
        for key, units in found.items()
        if key not in _AMBIGUOUS
        and all((u.dimension, u.factor) == (units[0].dimension, units[0].factor) for u in units)
    }


_FOLDED = _folded()


def known_unit(text: str) -> SpelledUnit | None:
    """The unit of a spelling; the case counts where two differ by it only (``mN m``, ``MN m``)."""
    for spelling in dict.fromkeys((_rate(text), text)):
        key = _key(spelling)
        if key in _KNOWN:
            return _KNOWN[key]
    key = _key(_rate(text))
    return _FOLDED.get(key.casefold()) if len(key) > 1 else None


def is_of_two_quantities(text: str) -> bool:
    """Whether a spelling is also a unit of another quantity: knots, nanometres."""
    return _key(text) in _TWO_QUANTITIES
