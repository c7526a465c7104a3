"""Units as other programs spell them: ``1/min``, ``U/min``, ``°``, ``Nm``, ``Inkr``, ``mV/V``.

A spelling has a dimension and the SI value of one unit. Units without an SI value of their own have
dimensions of this module: counts of an encoder, a share of the rated torque, a bridge's mV/V.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from dataclasses import dataclass
from functools import lru_cache

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
_FOREIGN: dict[str, dict[float, str]] = {
    "angle": {
        _TURN: "turns rev revs revolution revolutions U Umdr Umdrehung Umdrehungen tr tour tours "
        "vuelta vueltas giri rot rotation rotations cycles",
        _DEG: "° º degs degree degrees Grad Altgrad degre degres grado grados gradi",
        1.0: "radian radians Radiant",
        1e-6: "urad",
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
    },
    "torque": {
        1.0: "Nm N-m Newtonmeter newton-meter newton-meters",
        1e-3: "mNm mN-m Nmm N-mm",
        1e-2: "cNm Ncm",
        1e-6: "uNm",
        1e3: "kNm",
        _LB * _INCH: "lbin inlb lbfin inlbf lb-in in-lb",
        _LB * 12 * _INCH: "lbft ftlb lbfft ftlbf lb-ft ft-lb",
        GRAVITY: "kgfm kpm",
        GRAVITY * 1e-2: "kgfcm kpcm",
    },
    "force": {
        1.0: "Newton Newtons",
        10.0: "daN",
        1e-2: "cN",
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
        1e-9: "ns nsec nanosecond nanoseconds",
        60.0: "minute minutes Minuten",
        3600.0: "hr hrs hour hours Std Stunden",
        86400.0: "d day days Tage",
    },
    "current": {1.0: "Ampere Amp Amps ampere amperes Aeff Arms A_rms A_eff", 1e-3: "mAeff mArms"},
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
_DROPPED = re.compile(r"[\s·⋅*×•^_.]")
_LONGEST = 200
"""Longest name with a unit, characters."""
_PER_SECOND = re.compile(r"/\s*(sec|second|seconds|Sek|Sekunde)$")
_PAIRS = {"[": "]", "(": ")", "{": "}"}
_NO_UNIT = {"", "-", "--", "none", "n/a", "1", "/", "[]", "()", "bool", "no unit", "unitless"}


def _key(text: str) -> str:
    """A spelling without blanks, dots and signs of multiplication."""
    plain = text.strip().replace("µ", "u").replace("μ", "u")
    return _DROPPED.sub("", _PER_SECOND.sub("/s", plain))


def _known() -> dict[str, SpelledUnit]:
    found: dict[str, SpelledUnit] = {}
    ours = (
        *("angle", "angular speed", "torque", "force", "mass", "length", "speed", "time"),
        *("current", "voltage", "temperature"),
    )
    for dimension in ours:
        for unit, value in UNITS[dimension].items():
            found[_key(unit)] = SpelledUnit(unit, dimension, value)
    for dimension, spellings in _FOREIGN.items():
        table = UNITS.get(dimension, {})
        for value, words in spellings.items():
            ours_too = next((name for name, other in table.items() if other == value), None)
            for word in words.split():
                found.setdefault(_key(word), SpelledUnit(ours_too or word, dimension, value))
    for word in ("F", "°F", "degF", "Fahrenheit"):
        found[_key(word)] = _OTHER_OFFSET["F"]
    for word in ("K", "Kelvin"):
        found[_key(word)] = _OTHER_OFFSET["K"]
    return found


_KNOWN = _known()
_FOLDED = {key.casefold(): unit for key, unit in reversed(_KNOWN.items())}


@lru_cache(4096)
def read_unit(text: str) -> SpelledUnit | None:
    """The unit of a spelling, with or without brackets; None for another text.

    ``text``: spelling, e.g. ``1/min`` or ``(Nm)``. Returns: the case counts where two units differ
    by it only (``mN``, ``MN``).
    """
    inner = _inner(text)
    # "V (Voltage)" and "A(rms)": a unit with a description.
    first = re.split(r"\s+\(", inner)[0]
    for spelling in (inner, first):
        key = _key(spelling)
        if key:
            found = _KNOWN.get(key) or (_FOLDED.get(key.casefold()) if len(key) > 1 else None)
            if found is not None:
                return found
    return None


def _inner(text: str) -> str:
    stripped = text.strip()
    if len(stripped) > 1 and (_PAIRS | {"<": ">"}).get(stripped[0]) == stripped[-1]:
        return stripped[1:-1].strip()
    return stripped


def split_unit(text: str) -> tuple[str, str]:
    """Name and unit of a header cell.

    ``text``: ``Torque (Nm)``, ``speed/rpm``, ``pos_deg``, ``Kraft in N``, ``time [s]``, ``t, s``.
    Returns: the unit is empty where the cell has none that is known; a unit in brackets is one also
    where it is not known.
    """
    bracketed = _in_brackets(text)
    if bracketed is not None:
        return bracketed
    plain = text.strip()
    best = plain, ""
    if len(plain) > _LONGEST:
        return best
    for mark in (r"\s*/\s*", r"\s+in\s+", r"\s*,\s*", r"_", r"\s+", r"\."):
        for cut in re.finditer(rf"(?<=[^\s/]){mark}", plain):
            unit = plain[cut.end() :]
            known = read_unit(unit)
            # The longest unit: ``speed_rad/s`` is not in seconds.
            if known is not None and len(unit) > len(best[1]) and _is_safe(unit, mark, known):
                best = plain[: cut.start()], unit
    return best


def _in_brackets(text: str) -> tuple[str, str] | None:
    """Name and unit of a cell by its brackets, which may be nested; None without a unit.

    The last known unit is the unit: ``Force (Load Cell 1 (N))``, ``Torque [Nm] (filtered)``. A
    bracket at the end that has no known unit has an unknown one where it is square: an index
    (``pos[0]``) is part of the name.
    """
    found = [item for item in _brackets(text) if text[: item[0]].strip()]
    end = len(text.rstrip())
    for start, stop, inner in reversed(found):
        known = read_unit(inner)
        is_sure = stop == end or text[start] != "(" or inner.casefold() not in _SHORT_WORDS
        if known is not None and is_sure and not inner.isdecimal():
            rest = re.sub(r"\(\s*\)|\[\s*\]|\{\s*\}", "", f"{text[:start]} {text[stop:]}")
            return re.sub(r"\s+([)\]}])", r"\1", " ".join(rest.split())), inner
    last = next((item for item in found if item[1] == end), None)
    if last is None:
        return None
    start, _, inner = last
    is_square, is_apart = text[start] == "[", text[start - 1].isspace()
    if inner.isdecimal() and not (is_square and is_apart and inner in _NO_UNIT):
        return (text.strip(), "") if is_square else None
    if inner.lower() in _NO_UNIT:
        return text[:start].strip(), ""
    return (text[:start].strip(), inner) if is_square else None


def _brackets(text: str) -> list[tuple[int, int, str]]:
    """Start, end and content of every pair of brackets, in the order of their ends."""
    found, opened = [], list[int]()
    for index, char in enumerate(text[:_LONGEST]):
        if char in _PAIRS:
            opened.append(index)
        elif opened and char == _PAIRS[text[opened[-1]]]:
            start = opened.pop()
            found.append((start, index + 1, text[start + 1 : index].strip()))
    return found


_SHORT_WORDS = frozenset(
    ["in", "a", "p", "t", "c", "k", "f", "h", "d", "g", "u", "r", "ct", "tr", "rot", "''"]
)
_PLAIN_WORDS = {"count", "counts", "steps", "rotation", "rotations", "cycles", "pulses", "tour"}
"""Words of names that are also units."""


def _is_safe(unit: str, mark: str, known: SpelledUnit) -> bool:
    """Whether a word at the end of a name is a unit, and not a part of the name.

    ``joint_position_in``, ``motor_a`` and ``load_t`` have names of one or two letters; ``pos_rad``
    and ``torque_Nm`` have units.
    """
    if mark in {r"\s*/\s*", r"\s+in\s+", r"\s*,\s*"}:
        return True
    word = unit.strip()
    if _key(word).casefold() in _SHORT_WORDS:
        return False
    if word.casefold() in _PLAIN_WORDS:
        return known.dimension == COUNTS
    return word not in {"m", "s", "N", "V", "min"} or mark == "_"


def named_unit(name: str, dimensions: Collection[str]) -> SpelledUnit | None:
    """The unit that one word of a name is: ``rpm``, ``speed_rpm_left``, ``Nm 2``.

    ``name``: name of a column without a unit at its end or in brackets. Returns: None without such
    a word, and for several.
    """
    found = set()
    for word in re.split(r"[^A-Za-z°]+", name[:_LONGEST]):
        unit = read_unit(word)
        is_word = len(word) < 2 or word.casefold() in {*_SHORT_WORDS, *_PLAIN_WORDS}
        if unit is not None and not is_word and unit.dimension in dimensions:
            found.add(unit)
    return found.pop() if len(found) == 1 else None


def is_unit_row(cells: list[str]) -> bool:
    """Whether a row below or above the names has the units of the columns.

    Returns: at least half of the cells with text are units, and one of them is.
    """
    given = [cell.strip() for cell in cells if cell.strip()]
    units = [cell for cell in given if read_unit(cell)]
    neutral = [cell for cell in given if cell.lower().strip("[](){}") in _NO_UNIT]
    return bool(units) and len(units) + len(neutral) >= 0.5 * len(given)
