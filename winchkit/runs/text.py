"""Turns the bytes of a CSV file into lines, whichever program wrote them."""

from __future__ import annotations

import codecs
from pathlib import Path

from winchkit.errors import Fault, RunError

__all__ = ["read_bytes", "read_lines"]


def read_bytes(path: Path, *, may_be_empty: bool = False) -> bytes:
    """Content of a file; raises RunError where there is none to read."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise RunError(Fault("there is no such file", str(path))) from None
    except IsADirectoryError:
        raise RunError(Fault("is a directory, not a run", str(path))) from None
    except OSError as error:
        raise RunError(Fault(f"cannot be read: {error.strerror}", str(path))) from None
    except ValueError as error:
        raise RunError(Fault(f"is no usable file name: {error}", repr(str(path)))) from None
    if not data and not may_be_empty:
        raise RunError(Fault("the file is empty", str(path)))
    return data


def read_lines(path: Path) -> list[str]:
    """Lines of a text file in UTF-8, UTF-16 with its mark, or Windows-1252."""
    data = read_bytes(path)
    try:
        text = _decode(data)
    except UnicodeDecodeError:
        raise RunError(Fault("is not a text file; save it as CSV in UTF-8", str(path))) from None
    if "\0" in text:
        raise RunError(Fault("is a binary file, not CSV text", str(path)))
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _decode(data: bytes) -> str:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252")
