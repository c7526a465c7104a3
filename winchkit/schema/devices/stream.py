"""Contents of a device file of an instrument on a serial line, polled or continuously sending.

Bytes are written as text, one character a byte (Latin-1); ``\\u001b`` is ESC.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from winchkit.errors import UsageError, suggest
from winchkit.schema.quantity import (
    Duration,
    Number,
    PositiveDuration,
    PositiveNumber,
    PositiveRate,
    Whole,
    WholeNumber,
)
from winchkit.schema.table import Rule, Table
from winchkit.schema.template import Part, fields_of, length_of, parts_of
from winchkit.units import dimension_of

Says = Literal[
    "good",
    "overload",
    "underload",
    "fault",
    "stable",
    "unstable",
    "net",
    "gross",
    "zero",
    "stale",
    "negative",
    "busy",
    "refused",
]
"""Meanings of a status letter, a status bit, a word or a reply."""
NUMBERS = ("value", "gross", "tare")
"""Fields that hold a number in the device's unit."""
_OWN = (*NUMBERS, "unit", "address", "checksum", "bits", "skip")


@dataclass(frozen=True)
class AskSpec(Table):
    """A request and its possible replies; ``{address:3}`` is the device's address."""

    send: str
    answer: tuple[str, ...] = ()
    """A ``*`` in it stands for any text; without answers the device does not reply."""


@dataclass(frozen=True)
class FreshSpec(Table):
    """Request for the presence of a new value: bits with the meaning ``stale``."""

    send: str
    frame: str = "{bits}"


@dataclass(frozen=True)
class ChecksumSpec(Table):
    """Two hexadecimal digits, the field ``checksum``, over the characters between two marks."""

    kind: Literal["xor", "sum", "sum-complement"]
    after: str = ""
    """Character before the first summed one; empty: the sum starts at the start of the line."""
    before: str = ""
    """Character behind the last summed one; empty: the sum ends at the check sum."""


@dataclass(frozen=True)
class BinarySpec(Table):
    """A frame of ``length`` bytes of any value, followed by the terminator."""

    length: WholeNumber
    value: tuple[Annotated[int, Whole(0)], WholeNumber]
    """First byte of the value (from 0) and number of bytes, two's complement."""
    bits: Annotated[int, Whole(0)] | None = None
    """Byte that holds the status bits."""
    order: Literal["big", "little"] = "big"

    def rules(self) -> Iterator[Rule]:
        """The fields lie within the frame."""
        first, size = self.value
        if first + size > self.length:
            yield "value", f"bytes {first} to {first + size - 1} are not within {self.length} bytes"
        if self.bits is not None and self.bits >= self.length:
            yield "bits", f"byte {self.bits} is not within {self.length} bytes"


@dataclass(frozen=True)
class UnitSpec(Table):
    """Scale of a unit that a frame names: ``kg = { scale = 9.80665, unit = "N" }``."""

    scale: Number
    unit: str


@dataclass(frozen=True)
class StatusBitsSpec(Table):
    """Bits of a field of one character; exactly one of ``says``, ``factor``, ``unit`` has items.

    A frame with a number whose item is empty is invalid.
    """

    field: str
    bits: tuple[Annotated[int, Whole(0, 7)], ...]
    """From 0, the least significant first."""
    says: tuple[Says | Literal[""], ...] = ()
    factor: tuple[PositiveNumber, ...] = ()
    """Of the numbers of the frame, which then have no decimal point."""
    unit: tuple[str, ...] = ()
    """Keys of the table ``units``."""

    def rules(self) -> Iterator[Rule]:
        """There is one kind of items, and one item for each number."""
        given = [items for items in (self.says, self.factor, self.unit) if items]
        if len(given) != 1:
            yield "", "give exactly one of 'says', 'factor' and 'unit'"
            return
        wanted = 2 ** len(self.bits)
        if not self.bits or len(set(self.bits)) < len(self.bits) or len(given[0]) != wanted:
            yield "bits", f"{len(given[0])} items for {len(self.bits)} bits; give {wanted} items"


@dataclass(frozen=True)
class LinkSpec(Table):
    """The maker's settings of the line, printed when the device does not answer."""

    baudrate: WholeNumber
    parity: Literal["N", "E", "O"] = "N"
    stopbits: Literal[1, 2] = 1
    bytesize: Literal[7, 8] = 8

    def __str__(self) -> str:
        return f"{self.baudrate} {self.bytesize}{self.parity}{self.stopbits}"


@dataclass(frozen=True)
class StreamSpec(Table):
    """An instrument on a serial line, read in lines of text or in binary frames."""

    mode: Literal["polled", "continuous"]
    example: str
    """A frame as printed in the source, without terminator; the simulated device sends its form."""
    frame: tuple[str, ...] = ()
    """Templates of a line with the field ``value``, the usual one first."""
    binary: BinarySpec | None = None
    terminator: str = "\r\n"
    longest: WholeNumber = 64
    """Characters of the longest line."""
    checksum: ChecksumSpec | None = None
    unit: str = "1"
    scale: Number = 1.0
    """Value of one count of the field ``value``, in ``unit``."""
    units: Mapping[str, UnitSpec] = field(default_factory=dict)
    """Units that the frame names, by their text there, in place of ``unit`` and ``scale``."""
    capacity: PositiveNumber | None = None
    """A number in the frame whose magnitude exceeds this is an overload."""
    words: Mapping[str, Says] = field(default_factory=dict)
    """Text in place of the digits."""
    replies: Mapping[str, Says] = field(default_factory=dict)
    """Lines in place of a frame; a ``*`` in it stands for anything."""
    letter: Mapping[str, Mapping[str, Says]] = field(default_factory=dict)
    """Texts of a status field by the field's name; a frame with any other text is invalid."""
    bits: Mapping[Says, tuple[Annotated[int, Whole(0, 31)], ...]] = field(default_factory=dict)
    """Bits of the number in the field ``bits``, from 0."""
    status: tuple[StatusBitsSpec, ...] = ()
    """Bits of status characters."""
    start: tuple[AskSpec, ...] = ()
    """Sent at the first contact with the device, and again after a timeout."""
    stop: str = ""
    """Stops continuous sending, before a command and at the end."""
    poll: str = ""
    fresh: FreshSpec | None = None
    select: AskSpec | None = None
    """Sent before the first request to another device of the line."""
    command: Mapping[str, AskSpec] = field(default_factory=dict)
    link: LinkSpec | None = None
    rate: PositiveRate = 100.0
    """Conversions per second."""
    filter_delay: Duration = 0.0
    """Age of a value when it is sent, s."""
    longest_reply: PositiveDuration = 0.1
    """Longest time to an answer, s."""

    def rules(self) -> Iterator[Rule]:
        """A device has one form of frame, and all fields of it are declared."""
        if (self.binary is None) == (not self.frame):
            yield "", "give either 'frame', templates of lines, or the table 'binary'"
        if self.binary is not None and self.mode == "continuous":
            yield "mode", "the start of a binary frame is not marked; it can only be polled"
        if (self.mode == "polled") != bool(self.poll):
            yield "poll", "a polled device needs its request here, a continuous one has none"
        if not self.terminator:
            yield "terminator", "empty; give the characters that end a frame"
        if self.binary is not None and (self.units or self.words):
            yield "binary", "a binary frame has neither units nor words"
        if self.capacity is not None and self.units:
            yield "capacity", "has no meaning where the frame names the unit"
        yield from self._broken_units()
        yield from self._broken_status()
        yield from self._broken_templates()
        yield from self._broken_requests()
        yield from self._broken_example()

    def dimension(self) -> str | None:
        """Dimension of the value; None where a unit is unknown or there are several."""
        units = [one.unit for one in self.units.values()] or [self.unit]
        found = {dimension_of(unit) for unit in units}
        return found.pop() if len(found) == 1 else None

    def templates(self) -> tuple[tuple[Part, ...], ...]:
        """Templates of its lines in pieces; raises UsageError."""
        return tuple(parts_of(text) for text in self.frame)

    def _broken_units(self) -> Iterator[Rule]:
        if self.dimension() is None:
            known = ", ".join(sorted({one.unit for one in self.units.values()} or {self.unit}))
            yield "unit", f"{known}: unknown, or not of one dimension"
        if any(one.scale == 0.0 for one in self.units.values()) or self.scale == 0.0:
            yield "scale", "must not be zero"

    def _broken_status(self) -> Iterator[Rule]:
        for place, group in enumerate(self.status):
            if group.field in (*_OWN, *self.letter):
                yield f"status.{place}.field", f"'{group.field}' has another meaning; rename it"
            for unit in group.unit:
                if unit and unit not in self.units:
                    known = ", ".join(self.units) or "there is none"
                    yield f"status.{place}.unit", f"'{unit}' is no key of 'units': {known}"
        if sum(bool(group.unit) for group in self.status) > 1:
            yield "status", "two groups of bits give the unit; keep one"

    def _broken_templates(self) -> Iterator[Rule]:
        asked = [("fresh.frame", self.fresh.frame)] if self.fresh else []
        for key, text in [("frame", text) for text in self.frame] + asked:
            try:
                parts = parts_of(text)
            except UsageError as error:
                yield key, str(error)
                continue
            for message in self._broken_fields(parts, {part.field for part in parts}):
                yield key, f"'{text}': {message}"
            if key == "frame" and not any(part.field == "value" for part in parts):
                yield key, f"'{text}' has no field {{value}}"

    def _broken_requests(self) -> Iterator[Rule]:
        """Requests contain no field but the address, and only characters that are bytes."""
        asked = [("start", ask) for ask in self.start]
        asked += [(f"command.{name}", ask) for name, ask in self.command.items()]
        asked += [("select", self.select)] if self.select else []
        texts = [("poll", self.poll), ("stop", self.stop)]
        texts += [("fresh.send", self.fresh.send)] if self.fresh else []
        for key, text in texts + [(f"{key}.send", ask.send) for key, ask in asked]:
            try:
                strange = {part.field for part in parts_of(text)} - {"", "address"}
            except UsageError as error:
                yield key, str(error)
                continue
            for name in sorted(strange):
                yield key, f"'{text}': {{{name}}} is unknown; use {{address}} or {{address:3}}"
            if not _is_bytes(text):
                yield key, f"'{text}' has characters that are not bytes"
        if not _is_bytes(self.terminator):
            yield "terminator", f"'{self.terminator}' has characters that are not bytes"

    def _broken_example(self) -> Iterator[Rule]:
        """The example is a frame."""
        if self.binary is not None:
            digits = 2 * self.binary.length
            if len(self.example) != digits or set(self.example) - set("0123456789abcdef"):
                yield "example", f"'{self.example}' is not {digits} digits out of 0 to f"
            return
        try:
            templates = self.templates()
        except UsageError:
            return  # reported already, at its own key
        for key, text in [("example", self.example), *(("frame", text) for text in self.frame)]:
            if self.terminator and self.terminator in text:
                yield (
                    key,
                    f"'{text}' contains the terminator, which ends a line and is no part of it",
                )
        if templates and fields_of(templates[0], self.example) is None:
            yield "example", f"'{self.example}' does not fit '{self.frame[0]}'"

    def _broken_fields(self, parts: tuple[Part, ...], names: set[str]) -> Iterator[str]:
        status = {group.field for group in self.status}
        for name in sorted(names - {"", *_OWN, *self.letter, *status}):
            known = [*_OWN, *self.letter, *sorted(status)]
            yield (
                f"no field is called {{{name}}}; use {', '.join(known)}, or declare the texts of a "
                f"status field in a table 'letter.{name}'{suggest(name, known)}"
            )
        for part in parts:
            if part.field in status and part.width != 1:
                yield f"{{{part.field}}} has status bits; write {{{part.field}:1}}"
        if ("checksum" in names) != (self.checksum is not None) and "value" in names:
            yield "a field {checksum:2} and the table 'checksum' go together"
        if "unit" in names and not self.units:
            yield "{unit} needs the table 'units'"
        named = "unit" in names or any(group.unit and group.field in names for group in self.status)
        if "value" in names and self.units and not named:
            yield "there is a table 'units' and no field {unit}"
        length = length_of(parts)
        if length is not None and length > self.longest:
            yield f"its {length} characters are more than 'longest', {self.longest}"


def _is_bytes(text: str) -> bool:
    """Whether each character is one byte."""
    return all(ord(letter) < 256 for letter in text)
