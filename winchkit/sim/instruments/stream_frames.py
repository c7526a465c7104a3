"""Frames, status and replies of a simulated serial instrument."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from math import isfinite
from operator import xor

from winchkit.errors import FileError
from winchkit.schema.devices.stream import ChecksumSpec, Says, StatusBitsSpec, StreamSpec, UnitSpec
from winchkit.schema.template import Part, fields_of


@dataclass(frozen=True)
class NumberStyle:
    """Format of a number."""

    width: int | None
    decimals: int
    plus: bool
    zeros: bool
    """Padded with zeros, else with spaces."""
    sign_first: bool
    """The sign precedes the padding."""

    def write(self, number: float) -> str | None:
        """Text of a number, None where it does not fit its width."""
        digits = f"{abs(number):.{self.decimals}f}"
        negative = number < 0 and float(digits) != 0.0
        sign = "-" if negative else ("+" if self.plus else "")
        if self.width is None:
            return sign + digits
        room = self.width - len(sign)
        if len(digits) > room:
            return None
        if self.zeros:
            return sign + digits.rjust(room, "0")
        if self.sign_first:
            return (sign or " ") + digits.rjust(self.width - 1)
        return (sign + digits).rjust(self.width)


def style_of(text: str, width: int | None) -> NumberStyle:
    """Format of a number in an example."""
    bare = text.strip()
    signed = bare[:1] in "+-"
    digits = bare[signed:]
    return NumberStyle(
        width,
        len(digits.partition(".")[2]),
        bare.startswith("+"),
        digits.startswith("0") and digits[1:2].isdigit(),
        signed and text[0] in "+-" and digits.startswith(" "),
    )


def example_fields(spec: StreamSpec) -> dict[str, str]:
    """Fields of the example by its first template; FileError where it does not fit."""
    fields = fields_of(spec.templates()[0], spec.example)
    if fields is None:
        raise FileError(f"the example '{spec.example}' does not fit '{spec.frame[0]}'")
    return fields


def example_unit(spec: StreamSpec) -> UnitSpec:
    """Scale and unit of the example's digits."""
    if not spec.units:
        return UnitSpec(spec.scale, spec.unit)
    fields = example_fields(spec)
    for group in spec.status:
        if group.unit:
            return spec.units[group.unit[number_of(group, fields[group.field])]]
    return spec.units[fields["unit"].strip()]


def number_of(group: StatusBitsSpec, character: str) -> int:
    """Number in the bits of a status character."""
    bits = f"{ord(character):08b}"[::-1]
    return int("".join(bits[bit] for bit in reversed(group.bits)), 2)


def write_line(
    parts: tuple[Part, ...], fields: dict[str, str], checksum: ChecksumSpec | None
) -> str:
    """A line of the fields; its check sum is computed where one is declared."""
    line = ""
    for part in parts:
        text = part.literal or fields.get(part.field, "")
        line += text[: part.width].ljust(part.width) if part.width is not None else text
    if checksum is None or "checksum" not in {part.field for part in parts}:
        return line
    width = next(part.width or 2 for part in parts if part.field == "checksum")
    blank = write_line(parts, {**fields, "checksum": "#" * width}, None)
    return blank.replace("#" * width, f"{_sum(checksum, blank, width):0{width}X}")


def _sum(checksum: ChecksumSpec, line: str, width: int) -> int:
    counted = line[: len(line) - width]
    if checksum.before:
        counted = line.rpartition(checksum.before)[0]
    if checksum.after:
        counted = counted.partition(checksum.after)[2]
    codes = [ord(letter) for letter in counted]
    if checksum.kind == "xor":
        return reduce(xor, codes, 0)
    total = sum(codes) % 256
    return total if checksum.kind == "sum" else 255 - total


_STABLE_DIGITS = 100
"""Change in digits between conversions below which the load is stable, as of the Modbus
instruments."""
_ALARMS: tuple[Says, ...] = ("fault", "overload")
_IN_BITS: tuple[Says, ...] = ("overload", "underload", "fault", "unstable", "stable", "net")


@dataclass(frozen=True, slots=True)
class IndicatorState:
    """State of an instrument, in the unit of its frames."""

    net: float
    """NaN where no measurement was possible."""
    gross: float
    motion: float
    tared: bool
    overload: bool
    broken: bool
    address: int | None
    spoilt: bool = False
    """Whether the check sum is made wrong."""


class Speech:
    """Output of one kind of device."""

    def __init__(self, spec: StreamSpec) -> None:
        """Raise FileError where the device file's example does not fit its frame."""
        self._spec = spec
        self._example = example_fields(spec) if spec.binary is None else {}
        self._factor = 1.0
        """One of the example's digits, by its status characters."""
        for group in spec.status:
            if group.factor:
                self._factor *= group.factor[number_of(group, self._example[group.field])]

    def line(self, text: str) -> bytes:
        """A line of text."""
        return (text + self._spec.terminator).encode("latin-1")

    def reply(self, *wanted: Says) -> str | None:
        """The reply with one of these meanings, None where the device has none."""
        found = [text for text, says in self._spec.replies.items() if says in wanted]
        return found[0].replace("*", " ").strip() if found else None

    def status(self, state: IndicatorState, *, old: bool) -> bytes:
        """The reply to the request for the presence of a new value."""
        assert self._spec.fresh is not None, "called only where the device file has the request"
        bits = self._bits(self._truths(state)) | self._bit("stale", old)
        return self.line(self._spec.fresh.frame.replace("{bits}", str(bits)))

    def frame(self, state: IndicatorState) -> bytes:
        """The frame with the state."""
        truths = self._truths(state)
        if self._spec.binary is not None:
            return self._binary(state, truths)
        said: Says | None = next((one for one in _ALARMS if truths[one]), None)
        if said is not None and (reply := self.reply(said)) is not None:
            return self.line(reply)
        fields = {**self._example, **self._fields(state, truths, said)}
        line = write_line(self._spec.templates()[0], fields, self._spec.checksum)
        if state.spoilt and "checksum" in self._example:
            line = line[:-1] + ("0" if line[-1] != "0" else "1")
        return self.line(line)

    def _fields(
        self, state: IndicatorState, truths: dict[Says, bool], said: Says | None
    ) -> dict[str, str]:
        fields = self._status(truths)
        net = abs(state.net) if self._can_say("negative") else state.net
        tare = state.gross - state.net
        for name, number in (("value", net), ("gross", state.gross), ("tare", tare)):
            if name in self._example:
                fields[name] = self._digits(name, number / self._factor, said)
        for name, letters in self._spec.letter.items():
            fits = [text for text, says in letters.items() if truths.get(says, False)]
            fields[name] = fits[0] if fits else self._example.get(name, "")
        if "bits" in self._example:
            fields["bits"] = f"{self._bits(truths):0{len(self._example['bits'])}d}"
        if "address" in self._example and state.address is not None:
            fields["address"] = f"{state.address:0{len(self._example['address'])}d}"
        return fields

    def _status(self, truths: dict[Says, bool]) -> dict[str, str]:
        """Status characters: those of the example, with the bits of what is true."""
        characters: dict[str, str] = {}
        for group in self._spec.status:
            true = [place for place, says in enumerate(group.says) if says and truths.get(says)]
            code = ord(characters.get(group.field, self._example[group.field]))
            if true:
                for place, bit in enumerate(group.bits):
                    code = code & ~(1 << bit) | (true[0] >> place & 1) << bit
            characters[group.field] = chr(code)
        return characters

    def _digits(self, name: str, number: float, said: Says | None) -> str:
        width = next(part.width for part in self._spec.templates()[0] if part.field == name)
        if said is not None and self._can_say(said):
            word = next((text for text, says in self._spec.words.items() if says == said), "")
            return word.center(width or 0)
        text = style_of(self._example[name], width).write(number)
        return text if text is not None else "-" * (width or 0)

    def _binary(self, state: IndicatorState, truths: dict[Says, bool]) -> bytes:
        layout = self._spec.binary
        assert layout is not None, "called for a binary frame"
        first, size = layout.value
        highest = (1 << (8 * size - 1)) - 1
        counts = round(state.net) if isfinite(state.net) else 0
        clipped = min(max(counts, -highest - 1), highest)
        frame = bytearray(layout.length)
        frame[first : first + size] = clipped.to_bytes(size, layout.order, signed=True)
        if layout.bits is not None:
            frame[layout.bits] = self._bits(truths) | self._bit("overload", clipped != counts)
        return bytes(frame) + self._spec.terminator.encode("latin-1")

    def _truths(self, state: IndicatorState) -> dict[Says, bool]:
        """Meanings that are true for the shown conversion."""
        alarm = state.overload or state.broken
        stable = state.motion < _STABLE_DIGITS * self._one_digit()
        says_fault = self._can_say("fault")
        return {
            "overload": state.overload or (state.broken and not says_fault),
            "fault": state.broken and says_fault,
            "unstable": not stable and not alarm,
            "stable": stable and not alarm,
            "negative": state.net < 0.0,
            "net": state.tared,
            "gross": not state.tared,
        }

    def _one_digit(self) -> float:
        if not self._example:
            return 1.0
        return self._factor * 10.0 ** -len(self._example["value"].strip().partition(".")[2])

    def _can_say(self, says: Says) -> bool:
        spec = self._spec
        said = [*spec.words.values(), *spec.replies.values(), *spec.bits]
        said += [says for group in spec.status for says in group.says if says]
        return says in said or any(says in one.values() for one in spec.letter.values())

    def _bits(self, truths: dict[Says, bool]) -> int:
        return sum(self._bit(says, truths.get(says, False)) for says in _IN_BITS)

    def _bit(self, says: Says, true: bool) -> int:
        numbers = self._spec.bits.get(says, ())
        return 1 << numbers[-1] if true and numbers else 0
