"""One frame turned into a value in SI or NaN, with flags; no number is ever guessed."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from enum import Enum, auto
from functools import reduce
from operator import xor
from typing import NamedTuple

from winchkit.drivers.reading import Quality
from winchkit.errors import Fault, FileError
from winchkit.schema.devices.stream import NUMBERS, ChecksumSpec, Says, StatusBitsSpec, StreamSpec
from winchkit.schema.template import Part, parts_of
from winchkit.units import convert

_ANY = r"[\x20-\x7e]"


class Match(NamedTuple):
    """Text of the fields by name, and how many characters stood before the frame."""

    fields: dict[str, str]
    before: int
    text: str


class Matcher:
    """One template. A field without width never holds the character that ends it."""

    def __init__(self, parts: tuple[Part, ...]) -> None:
        """``parts`` as the schema has checked them."""
        pieces = []
        for part, after in zip(parts, (*parts[1:], None), strict=True):
            pieces.append(_piece(part, after))
        self._pattern = re.compile("".join(pieces))
        self._first = parts[0].literal[:1] if parts else ""

    def match(self, line: str) -> Match | None:
        """Fit the whole line or, where the template begins with a literal, its last frame."""
        found = self._pattern.fullmatch(line)
        start = 0
        if found is None and self._first:
            start = line.rfind(self._first)
            found = self._pattern.fullmatch(line, start) if start > 0 else None
        if found is None:
            return None
        return Match(found.groupdict(), start, line[start:])


def fits(text: str, patterns: Iterable[str]) -> str | None:
    """The first pattern that a text fits; ``*`` stands for anything."""
    for pattern in patterns:
        if _fits(text, pattern.split("*")):
            return pattern
    return None


def _fits(text: str, pieces: list[str]) -> bool:
    """Greedy from the left, which is enough for stars only; linear in the text."""
    if len(pieces) == 1:
        return text == pieces[0]
    first, *middle, last = pieces
    if not text.startswith(first) or not text.endswith(last):
        return False
    at, end = len(first), len(text) - len(last)
    for piece in middle:
        at = text.find(piece, at, max(at, end))
        if at < 0:
            return False
        at += len(piece)
    return at <= end


def _piece(part: Part, after: Part | None) -> str:
    if part.literal:
        return re.escape(part.literal)
    if part.width is not None:
        inner = f"{_ANY}{{{part.width}}}"
    elif after is None:
        inner = f"{_ANY}+"
    else:
        ends = after.literal[0]
        inner = f" *[^{re.escape(ends)}\\x00-\\x1f\\x7f-\\xff]+"
    return inner if part.field == "skip" else f"(?P<{part.field}>{inner})"


_NUMBER = re.compile(r" *[+-]? *(?:[0-9]+\.?[0-9]*|\.[0-9]+) *")
_PADDING = " _"
_FLAGS: dict[Says, Quality] = {
    "overload": Quality.OVERLOAD,
    "underload": Quality.UNDERLOAD,
    "fault": Quality.FAULT,
    "unstable": Quality.UNSTABLE,
    "stale": Quality.STALE,
}


class FrameType(Enum):
    """Type of a frame."""

    READING = auto()
    STATUS = auto()
    """Status bits without a value."""
    ANSWER = auto()
    """The answer to a command."""
    BUSY = auto()
    REFUSED = auto()
    MALFORMED = auto()
    BAD_CHECKSUM = auto()


class StreamContent(NamedTuple):
    """Content of a frame."""

    value: float
    gross: float
    counts: float
    quality: Quality
    net: bool | None = None
    """Whether it is a net value, None where the frame does not say."""


class ParsedFrame(NamedTuple):
    """A frame with its type; ``before`` are the bytes of garbage in front of it."""

    meaning: FrameType
    text: str
    decoded: StreamContent | None = None
    before: int = 0


class _Status(NamedTuple):
    """Meanings, factor of the numbers and text of the unit, by the status of a frame."""

    said: list[Says]
    factor: float
    unit: str


NOTHING = StreamContent(math.nan, math.nan, math.nan, Quality.GOOD)


class StreamDecoder:
    """Decoder of the frames of one type of device."""

    def __init__(
        self, spec: StreamSpec, path: str, *, address: int | None = None, frames: tuple[str, ...]
    ) -> None:
        """``frames`` are the templates to expect; FileError where the file contradicts itself."""
        self._spec = spec
        self._address = address
        self._matchers = [Matcher(parts_of(text)) for text in frames]
        asked = (*spec.start, *spec.command.values(), *((spec.select,) if spec.select else ()))
        self._answers = [pattern for one in asked for pattern in one.answer]
        self._words = {text.strip(_PADDING): says for text, says in spec.words.items()}
        dimension = spec.dimension()
        if dimension is None:
            raise FileError(Fault(f"unknown unit '{spec.unit}'", path, key="stream.unit"))
        self.dimension = dimension
        self._masks = {says: sum(1 << bit for bit in bits) for says, bits in spec.bits.items()}

    def binary(self, data: bytes) -> ParsedFrame:
        """A frame of bytes."""
        layout = self._spec.binary
        assert layout is not None, "the schema gives a binary frame its layout"
        first, size = layout.value
        counts = float(int.from_bytes(data[first : first + size], layout.order, signed=True))
        said: list[Says] = [] if layout.bits is None else self._in_bits(data[layout.bits])
        return ParsedFrame(FrameType.READING, data.hex(), self._measured(said, counts, counts, ""))

    def line(self, data: bytes) -> ParsedFrame:
        """A line of text."""
        text = data.decode("latin-1")
        bare = text.strip()
        reply = fits(bare, self._spec.replies)
        if reply is not None:
            return self._reply(bare, self._spec.replies[reply])
        if fits(bare, self._answers) is not None:
            return ParsedFrame(FrameType.ANSWER, bare)
        spoilt = FrameType.MALFORMED
        for matcher in self._matchers:
            match = matcher.match(text)
            if match is None:
                continue
            if not self._is_whole(match):
                spoilt = FrameType.BAD_CHECKSUM
                continue
            decoded = self._fields(match.fields)
            if decoded is not None:
                kind = FrameType.READING if "value" in match.fields else FrameType.STATUS
                return ParsedFrame(kind, match.text, decoded, match.before)
        return ParsedFrame(spoilt, text)

    def _reply(self, text: str, says: Says) -> ParsedFrame:
        if says == "busy":
            return ParsedFrame(FrameType.BUSY, text)
        if says == "refused":
            return ParsedFrame(FrameType.REFUSED, text)
        return ParsedFrame(FrameType.READING, text, NOTHING._replace(quality=self._quality([says])))

    def _is_whole(self, match: Match) -> bool:
        spec = self._spec.checksum
        if spec is None or "checksum" not in match.fields:
            return True
        said = match.fields["checksum"].upper()
        return said == f"{check_sum(spec, match.text, len(match.fields['checksum'])):02X}"

    def _fields(self, fields: dict[str, str]) -> StreamContent | None:
        """Values of the fields, None where one of them is unknown."""
        address = fields.get("address")
        if address is not None and not self._is_mine(address):
            return None
        said: list[Says] = []
        for name, letters in self._spec.letter.items():
            if name in fields:
                says = letters.get(fields[name].strip())
                if says is None:
                    return None
                said.append(says)
        if "bits" in fields:
            bits = _number(fields["bits"])
            if not bits.is_integer() or not 0 <= bits < 1 << 32:
                return None
            said += self._in_bits(int(bits))
        status = self._status(fields)
        if status is None:
            return None
        if "value" not in fields:
            return NOTHING._replace(quality=self._quality(said + status.said))
        return self._numbers(fields, status._replace(said=said + status.said))

    def _status(self, fields: dict[str, str]) -> _Status | None:
        """Decoded status characters; None where the device file gives their bits no meaning."""
        found = _Status([], 1.0, fields.get("unit", "").strip())
        for group in self._spec.status:
            if group.field not in fields:
                continue
            item = _item(group, fields[group.field])
            if group.says and (says := group.says[item]):
                found.said.append(says)
            elif group.factor and not any("." in fields.get(name, "") for name in NUMBERS):
                found = found._replace(factor=found.factor * group.factor[item])
            elif group.unit and group.unit[item]:
                found = found._replace(unit=group.unit[item])
            else:
                return None
        return found

    def _numbers(self, fields: dict[str, str], status: _Status) -> StreamContent | None:
        said, factor, unit = status
        words = [self._word(fields[name], fields) for name in NUMBERS if name in fields]
        said += [word for word in words if word is not None]
        counts = _number(fields["value"]) * (-factor if "negative" in said else factor)
        gross = counts
        if "gross" in fields:
            gross = _number(fields["gross"]) * factor
        elif "tare" in fields and "net" in said:
            gross = counts + _number(fields["tare"]) * factor
        if self._quality(said).usable and not (math.isfinite(counts) and math.isfinite(gross)):
            return None
        if self._spec.units and unit not in self._spec.units and self._quality(said).usable:
            return None
        return self._measured(said, counts, gross, unit)

    def _word(self, digits: str, fields: dict[str, str]) -> Says | None:
        """Meaning of a text in place of the digits; one with a valid check sum is a fault."""
        text = digits.strip(_PADDING)
        if text in self._words:
            return self._words[text]
        known = math.isfinite(_number(digits))
        return "fault" if "checksum" in fields and not known else None

    def _is_mine(self, address: str) -> bool:
        text = address.strip()
        known = text.isascii() and text.isdecimal()
        return known and self._address in (None, int(text))

    def _in_bits(self, bits: int) -> list[Says]:
        said = [says for says, mask in self._masks.items() if bits & mask]
        if "stable" in self._masks and "stable" not in said:
            said.append("unstable")
        if "net" in self._masks and "net" not in said:
            said.append("gross")
        return said

    def _measured(self, said: list[Says], counts: float, gross: float, unit: str) -> StreamContent:
        quality = self._quality(said)
        capacity = self._spec.capacity
        if capacity is not None and abs(counts) > capacity:
            quality |= Quality.OVERLOAD
        net = "net" in said if "net" in said or "gross" in said else None
        if not quality.usable:
            return StreamContent(math.nan, math.nan, counts, quality, net)
        return StreamContent(self._si(counts, unit), self._si(gross, unit), counts, quality, net)

    def _si(self, number: float, unit: str) -> float:
        one = self._spec.units.get(unit, self._spec)
        return convert(number * one.scale, one.unit, self.dimension)

    def _quality(self, said: list[Says]) -> Quality:
        return reduce(lambda all_, says: all_ | _FLAGS.get(says, Quality.GOOD), said, Quality.GOOD)


def check_sum(spec: ChecksumSpec, text: str, digits: int) -> int:
    """Check sum (one byte) of a line that ends with, or has between its marks, its digits.

    Source: the manuals; Laumas XORs the characters between ``&`` and ``\\``, both excluded.
    """
    start = text.find(spec.after) + 1 if spec.after else 0
    end = text.rfind(spec.before) if spec.before else len(text) - digits
    data = text[start:end].encode("latin-1")
    if spec.kind == "xor":
        return reduce(xor, data, 0)
    total = sum(data) & 0xFF
    return total if spec.kind == "sum" else ~total & 0xFF


def _item(group: StatusBitsSpec, character: str) -> int:
    """The number that the bits of a status character make."""
    code = ord(character)
    return sum((code >> bit & 1) << place for place, bit in enumerate(group.bits))


def _number(text: str) -> float:
    """A decimal number, NaN where the text is none."""
    if _NUMBER.fullmatch(text) is None:
        return math.nan
    return float(text.replace(" ", ""))
