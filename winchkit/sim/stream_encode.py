"""Writes frames as a device file's example shows them: sign, padding and decimals are copied."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from operator import xor

from winchkit.errors import FileError
from winchkit.schema.device_stream import ChecksumSpec, StreamSpec
from winchkit.schema.template import Part, fields_of

__all__ = ["NumberStyle", "example_fields", "style_of", "write_line"]


@dataclass(frozen=True)
class NumberStyle:
    """How a number is written."""

    width: int | None
    decimals: int
    plus: bool
    zeros: bool
    """Padded by zeros, else by spaces."""
    sign_first: bool
    """The sign stands before the padding."""

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
    """The style of a number as an example shows it."""
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
