"""Line number of every key of a TOML text, which tomllib has parsed and does not report."""

from __future__ import annotations

import re
from bisect import bisect_right

Key = tuple[str | int, ...]
"""A place in a file: keys, and positions within arrays counted from 0."""

_SPACE = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'', re.DOTALL
)
_SCALAR = re.compile(r"[^,\]}#\n]*")


def lines_of_keys(text: str) -> dict[Key, int]:
    """Map every key, table and array element of a valid TOML text to its line, from 1."""
    return _Scanner(text).scan()


def line_of(key: Key, lines: dict[Key, int]) -> int:
    """Line of a key, or of the table nearest to where it is missing."""
    while key and key not in lines:
        key = key[:-1]
    return lines.get(key, 1)


class _Scanner:
    """One pass over the text; ``position`` moves forward only."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.position = 0
        self.starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self.lines: dict[Key, int] = {}
        self.arrays: dict[Key, int] = {}

    def scan(self) -> dict[Key, int]:
        table: Key = ()
        self.skip_space()
        while self.position < len(self.text):
            if self.text[self.position] == "[":
                table = self.header()
            else:
                self.pair(table)
            self.skip_space()
        return self.lines

    def header(self) -> Key:
        """Read ``[a.b]`` or ``[[a.b]]``; an array in the path stands for its last element."""
        start = self.position
        double = self.text.startswith("[[", start)
        self.position += 2 if double else 1
        words = self.dotted_key()
        self.position += 2 if double else 1
        table: Key = ()
        for word in words[:-1]:
            table = self.last_element((*table, word))
            self.note(table, start)
        table = (*table, words[-1])
        self.note(table, start)
        if double:
            self.arrays[table] = self.arrays.get(table, -1) + 1
        table = self.last_element(table)
        self.note(table, start)
        return table

    def last_element(self, table: Key) -> Key:
        return (*table, self.arrays[table]) if table in self.arrays else table

    def pair(self, table: Key) -> None:
        start = self.position
        for word in self.dotted_key():
            table = (*table, word)
            self.note(table, start)
        self.position += 1
        self.value(table)

    def value(self, key: Key) -> None:
        self.skip_space()
        opening = self.text[self.position]
        if opening == "[":
            self.array(key)
        elif opening == "{":
            self.inline_table(key)
        else:
            found = _STRING.match(self.text, self.position) or _SCALAR.match(
                self.text, self.position
            )
            self.position = found.end() if found else len(self.text)

    def array(self, key: Key) -> None:
        self.position += 1
        index = 0
        while self.next_until("]"):
            self.note((*key, index), self.position)
            self.value((*key, index))
            index += 1

    def inline_table(self, key: Key) -> None:
        self.position += 1
        while self.next_until("}"):
            self.pair(key)

    def next_until(self, closing: str) -> bool:
        """Go to the next element; False past the closing bracket."""
        self.skip_space()
        if self.text[self.position] == ",":
            self.position += 1
            self.skip_space()
        if self.text[self.position] != closing:
            return True
        self.position += 1
        return False

    def dotted_key(self) -> list[str]:
        words: list[str] = []
        while True:
            self.skip_space()
            if found := _BARE.match(self.text, self.position):
                words.append(found[0])
            elif found := _STRING.match(self.text, self.position):
                words.append(_plain(found[0]))
            else:
                return words
            self.position = found.end()
            self.skip_space()
            if self.text[self.position] != ".":
                return words
            self.position += 1

    def skip_space(self) -> None:
        found = _SPACE.match(self.text, self.position)
        self.position = found.end() if found else self.position

    def note(self, key: Key, position: int) -> None:
        self.lines.setdefault(key, bisect_right(self.starts, position))


def _plain(quoted: str) -> str:
    """A quoted key as tomllib reads it."""
    import tomllib

    return str(next(iter(tomllib.loads(f"{quoted} = 0"))))
