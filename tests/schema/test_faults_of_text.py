"""Texts and bytes that are no declaration, and warnings."""

from __future__ import annotations

from pathlib import Path

import pytest

from declared import WINCH, faults_of
from winchkit.errors import FileError
from winchkit.schema import read
from winchkit.schema.read import load, read_any


@pytest.mark.parametrize(
    ("text", "line", "part"),
    [
        ('schema = 1\nkind = "winch"\n[drum\n', 3, "TOML syntax"),
        ('schema = 1\nkind = "winch"\na = 1\na = 2\n', 4, "TOML syntax"),
        ('schema = 1\nkind = "winch"\na = """x', 3, "TOML syntax"),
        ('kind = "winch"\n', 1, "write schema = 1"),
        ('schema = 2\nkind = "winch"\n', 1, "2 is unknown"),
        ('schema = true\nkind = "winch"\n', 1, "True is unknown"),
        ("schema = 1\n", 1, "missing; use one of winch"),
        ('schema = 1\nkind = "whinch"\n', 2, "did you mean 'winch'?"),
        ("schema = 1\nkind = [1]\n", 2, "unknown kind [1]"),
        (" \n# nothing\n", 1, "schema"),
        ("", None, "empty"),
    ],
)
def test_text_that_is_no_declaration(file: Path, text: str, line: int | None, part: str) -> None:
    faults = faults_of(file, text)
    assert faults[0][0] == line
    assert part in faults[0][2]


def test_nested_too_deep(file: Path) -> None:
    depth = 100_000
    faults = faults_of(file, "a = " + "[" * depth + "]" * depth)
    assert "too deep" in faults[0][2]


@pytest.mark.parametrize(
    ("content", "part"),
    [(b"\x89PNG\r\n\x1a\n\x00\x01", "binary"), (b'name = "\xe9"', "E9h is not UTF-8")],
)
def test_bytes_that_are_no_text(file: Path, content: bytes, part: str) -> None:
    file.write_bytes(content)
    with pytest.raises(FileError, match=part):
        read_any(file)


def test_no_file_a_directory_and_an_odd_name(tmp_path: Path) -> None:
    for path, part in (
        (tmp_path / "nowhere.toml", "no such file"),
        (tmp_path, "directory"),
        ("a\0b.toml", "not a usable file name"),
    ):
        with pytest.raises(FileError, match=part):
            read_any(path)


def test_a_mark_of_byte_order_and_carriage_returns_do_no_harm(file: Path) -> None:
    file.write_bytes(b"\xef\xbb\xbf" + WINCH.replace("\n", "\r\n").encode())
    assert load(file).kind == "winch"


def test_another_kind_than_asked_for(file: Path) -> None:
    file.write_text(WINCH)
    with pytest.raises(FileError, match=r"file.toml:2: kind: is 'winch'; a 'bench' is needed here"):
        read.read_bench(file)


def test_a_guide_that_misses_its_groove_is_a_warning(file: Path) -> None:
    grooved = WINCH.replace('"spiral"', '"grooved"').replace(
        'layer_growth = "0.5 mm"', 'groove_pitch = "5 mm"'
    )
    guide = '[guide]\nscrew_lead = "2.5 mm"\nbelt_ratio = {}\n'
    file.write_text(grooved + guide.format(2))
    assert load(file).warnings == ()
    file.write_text(grooved + guide.format(1.9))
    (warning,) = load(file).warnings
    assert (warning.line, warning.key) == (11, "guide")
    assert "4.75 mm" in warning.message
