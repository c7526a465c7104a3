"""The line scanner against tomllib, which knows the keys, and an emitter, which knows the lines."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.schema.reading.lines import Key, line_of, lines_of_keys

BARE = st.text("abcXYZ019_-", min_size=1, max_size=6)
ODD = st.text("ab.#[]{}= ,'", min_size=1, max_size=6)
SCALARS = st.sampled_from(
    [
        "1",
        "-2.5e3",
        "true",
        "1979-05-27 07:32:00",
        '"a # [b] = {c}, \\" end"',
        "'c:\\d, ]'",
        '""',
        '"""one\n[two]\nx = "3" # no\n"""',
        "'''\n]] , '' }\n'''",
    ]
)


def keys_of(value: object, at: Key = ()) -> set[Key]:
    """Every place within a parsed document."""
    if isinstance(value, dict):
        items: list[tuple[str | int, object]] = list(value.items())
    elif isinstance(value, list):
        items = list(enumerate(value))
    else:
        return set()
    return {place for key, inner in items for place in ({(*at, key)} | keys_of(inner, (*at, key)))}


@st.composite
def values(draw: st.DrawFn, depth: int = 2) -> str:
    kind = draw(st.sampled_from(["scalar", "array", "inline"] if depth else ["scalar"]))
    if kind == "scalar":
        return draw(SCALARS)
    if kind == "array":
        items = draw(st.lists(values(depth - 1), max_size=3))
        gap = draw(st.sampled_from([", ", ",\n  ", " , # more ]\n"]))
        tail = draw(st.sampled_from(["", ",", "\n"])) if items else ""
        return "[" + gap.join(items) + tail + "]"
    keys = draw(st.lists(BARE, max_size=3, unique=True))
    return "{ " + ", ".join(f"{key} = {draw(SCALARS)}" for key in keys) + " }"


@st.composite
def documents(draw: st.DrawFn) -> tuple[str, dict[Key, int]]:
    """A TOML text of tables and arrays of tables, with the line of every key and table in it."""
    text, lines = "", {}

    def emit(piece: str, *places: Key) -> None:
        nonlocal text
        for place in places:
            lines.setdefault(place, text.count("\n") + 1)
        text += piece + "\n"

    def body(at: Key) -> None:
        for key in draw(st.lists(st.one_of(BARE, ODD), max_size=3, unique=True)):
            quoted = key if set(key) <= set("abcXYZ019_-") else '"' + key + '"'
            if draw(st.booleans()):
                emit(f"{quoted} . sub = {draw(values())}", (*at, key), (*at, key, "sub"))
            else:
                emit(f"{quoted} = {draw(values())}", (*at, key))
            emit(draw(st.sampled_from(["", "# x = [", "   "])))

    body(())
    for number, name in enumerate(draw(st.lists(BARE, max_size=3))):
        table: Key = (f"t{number}{name}",)
        if draw(st.booleans()):
            emit(f"[{table[0]}]", table)
            body(table)
            continue
        for index in range(draw(st.integers(1, 3))):
            emit(f"[[ {table[0]} ]] # next", table, (*table, index))
            body((*table, index))
            emit(f"[{table[0]}.inner]", (*table, index, "inner"))
            body((*table, index, "inner"))
    return text, lines


@given(documents())
def test_finds_every_key_that_tomllib_finds(document: tuple[str, dict[Key, int]]) -> None:
    text, lines = document
    found = lines_of_keys(text)
    assert set(found) == keys_of(tomllib.loads(text))
    assert {place: found[place] for place in lines} == lines


@pytest.mark.parametrize(
    "path",
    sorted(
        path
        for folder in ("devices", "examples", "profiles", "sim")
        for path in (Path(__file__).parents[3] / folder).rglob("*.toml")
    ),
    ids=lambda path: f"{path.parent.name}/{path.name}",
)
def test_reads_the_files_of_the_project(path: Path) -> None:
    text = path.read_text()
    assert set(lines_of_keys(text)) == keys_of(tomllib.loads(text))


def test_a_missing_key_is_on_the_line_of_its_table() -> None:
    lines = lines_of_keys("a = 1\n[b]\nc = 2\n[[d]]\n[[d]]\ne = 1\n")
    assert line_of(("b", "missing"), lines) == 2
    assert line_of(("d", 1, "missing", "deeper"), lines) == 5
    assert line_of(("nowhere",), lines) == 1
