"""Collects changelog fragments at a release: ``python docs/make_changelog.py 0.2.0``.

Each file of docs/changes/ is a Markdown list of changes that a user notices. Their items, sorted by
the names of the files, and the section *Unreleased* of CHANGELOG.md go below the heading of the new
version; the fragments are deleted.
"""

from __future__ import annotations

import datetime
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
_ITEM = re.compile(r"^- (?:.+\n)(?:  .*\n)*", re.MULTILINE)
_UNRELEASED = "## Unreleased\n"
_VERSION = re.compile(r"\d+\.\d+\.\d+")


def items(fragment: str) -> list[str]:
    """Items of a fragment; raises ValueError for text that is no item of a list."""
    found = _ITEM.findall(fragment)
    left = _ITEM.sub("", fragment).strip()
    if left or not found:
        raise ValueError(f"not a list of items '- …': {left[:60] or 'empty'}")
    return found


def collected(changelog: str, fragments: list[str], version: str, date: str) -> str:
    """CHANGELOG.md with a section for the version."""
    begin, found, rest = changelog.partition(_UNRELEASED)
    if not found:
        raise ValueError("CHANGELOG.md has no section '## Unreleased'")
    present, mark, older = ("\n" + rest).partition("\n## ")
    lists = "".join(item for fragment in fragments for item in items(fragment))
    body = lists + present.strip("\n")
    return f"{begin}{_UNRELEASED}\n## {version} – {date}\n\n{body.rstrip()}\n{mark}{older}"


def main(version: str) -> None:
    """Write CHANGELOG.md and delete the fragments."""
    if not _VERSION.fullmatch(version):
        raise SystemExit(f"'{version}' is no version; write it as 0.2.0")
    page = ROOT / "CHANGELOG.md"
    paths = sorted((ROOT / "docs" / "changes").glob("*.md"))
    texts = [path.read_text(encoding="utf-8") for path in paths]
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    page.write_text(
        collected(page.read_text(encoding="utf-8"), texts, version, today), encoding="utf-8"
    )
    for path in paths:
        path.unlink()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("usage: python docs/make_changelog.py VERSION")
    main(sys.argv[1])
