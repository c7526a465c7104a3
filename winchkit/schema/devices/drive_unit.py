"""Units of a drive's positions and speeds, written as products: ``1875 rpm / 512 / encoder``.

Numbers (``2^16``, ``1e-3``) and units are multiplied and divided from left to right; a number and
the unit behind it are one factor, so that ``counts / 65536 / 250 us`` divides by 250 us.
``increments`` (or ``counts``) is the drive's own unit of position, and ``encoder`` the number of
encoder increments of a motor turn.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from math import isfinite, pi

from winchkit.errors import UsageError, suggest
from winchkit.schema.quantity import Marker

_TURN = 2 * pi
_UNITS: dict[str, tuple[float, int, int]] = {
    "rad": (1.0, 1, 0),
    "mrad": (1e-3, 1, 0),
    "deg": (pi / 180, 1, 0),
    "turn": (_TURN, 1, 0),
    "rpm": (_TURN / 60, 1, -1),
    "s": (1.0, 0, 1),
    "ms": (1e-3, 0, 1),
    "us": (1e-6, 0, 1),
    "min": (60.0, 0, 1),
}
"""SI value, and powers of angle and time."""
_INCREMENTS = ("increments", "increment", "counts", "count")
_ENCODER = "encoder"
_TOKEN = re.compile(
    r"\s*(?:(?P<number>\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)(?:\^(?P<power>-?\d+))?"
    r"|(?P<word>[A-Za-z]+)|(?P<sign>[*/×·]))",
    re.ASCII,
)
_EXAMPLES = {
    "position": '"0.1 deg" or "turn / 10000"',
    "speed": '"0.1 rpm", "0.1 counts/s", "counts / 65536 / 250 us" or "1875 rpm / 512 / encoder"',
}


@dataclass(frozen=True)
class UnitProduct:
    """A unit as a number in rad and s, times powers of what only the drive has."""

    factor: float
    increments: int
    """Power of the drive's unit of position."""
    encoder: int
    """Power of the encoder's increments of a motor turn."""


@dataclass(frozen=True)
class DriveUnit(Marker):
    """Marks a text as the unit of a drive's ``position`` or ``speed``."""

    of: str

    @property
    def wanted(self) -> str:
        """Description of the expected value."""
        return f"a unit of {self.of}, such as {_EXAMPLES[self.of]}"

    def read(self, raw: object) -> str:
        """Check a value of a file; raises UsageError with the reason."""
        if not isinstance(raw, str):
            raise UsageError(f"expected {self.wanted}, not {raw!r}")
        try:
            product_of(raw, self.of)
        except ValueError as error:
            raise UsageError(f"'{raw}' {error}; write such as {_EXAMPLES[self.of]}") from None
        return raw


@cache
def product_of(text: str, of: str) -> UnitProduct:
    """A unit of ``position`` or ``speed`` as numbers; raises ValueError for another text."""
    try:
        return _read(text, of)
    except ArithmeticError:
        raise ValueError("is beyond what a number holds, or divides by zero") from None


def _read(text: str, of: str) -> UnitProduct:
    factor, powers = 1.0, {"angle": 0, "time": 0, "increments": 0, _ENCODER: 0}
    divides, wants_factor, at = False, True, 0
    text = text.rstrip()
    while at < len(text):
        token = _TOKEN.match(text, at)
        if token is None:
            raise ValueError(f"cannot be read from '{text[at:].strip()}' on")
        at = token.end()
        if token["sign"]:
            if wants_factor:
                raise ValueError(f"has nothing before '{token['sign']}'")
            divides, wants_factor = token["sign"] == "/", True
            continue
        sign = -1 if divides else 1
        if token["number"]:
            if not wants_factor:
                raise ValueError(f"has no sign before {token['number']}")
            factor *= (float(token["number"]) ** int(token["power"] or 1)) ** sign
        else:
            value, angle, time = _of_word(token["word"])
            factor *= value**sign
            powers["angle"] += sign * angle
            powers["time"] += sign * time
            powers["increments"] += sign * (token["word"] in _INCREMENTS)
            powers[_ENCODER] += sign * (token["word"] == _ENCODER)
        wants_factor = False
    if wants_factor:
        raise ValueError("is empty" if not text.strip() else "ends with a sign")
    if (powers["angle"], powers["time"]) != (1, -1 if of == "speed" else 0):
        raise ValueError(f"is no {'angle per time' if of == 'speed' else 'angle'}")
    if not isfinite(factor) or factor <= 0:
        raise ValueError("is not above zero")
    return UnitProduct(factor, powers["increments"], powers[_ENCODER])


def _of_word(word: str) -> tuple[float, int, int]:
    if word in _INCREMENTS:
        return 1.0, 1, 0
    if word == _ENCODER:
        return 1.0, 0, 0
    if word not in _UNITS:
        known = [*_UNITS, "increments", "counts", _ENCODER]
        raise ValueError(f"has the unknown unit '{word}'{suggest(word, known)}")
    return _UNITS[word]
