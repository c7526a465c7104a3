"""Builds the documentation site: ``python docs/make_site.py``, with the extra ``docs``.

The pages of docs/ and those of the top folder are copied to docs/site/pages, with the links between
them rewritten; zensical makes docs/site/html of them by docs/zensical.toml. Warnings are errors.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

DOCS = Path(__file__).parent
ROOT = DOCS.parent
CONFIGURATION = DOCS / "zensical.toml"
SITE = DOCS / "site"
OUTSIDE = {
    "README.md": "readme.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "benchmarks/README.md": "benchmarks.md",
    ".github/SECURITY.md": "security.md",
}
"""Pages outside docs/, and their names on the site."""
PICTURES = (".svg", ".png")
_LINK = re.compile(r"\]\((?!\w+:|#)([^)\s#]+)(#[^)\s]*)?\)")


def sources() -> Iterator[tuple[Path, str]]:
    """Each page and picture, and its place on the site."""
    for path in sorted(DOCS.rglob("*")):
        place = path.relative_to(DOCS)
        if place.parts[0] in {"site", "changes"} or path.suffix not in {".md", *PICTURES}:
            continue
        yield path, place.as_posix()
    for source, place_of_it in OUTSIDE.items():
        yield ROOT / source, place_of_it


def stage(pages: Path) -> list[str]:
    """Copy all pages with their links rewritten; return their places."""
    shutil.rmtree(pages, ignore_errors=True)
    places = {path.resolve(): place for path, place in sources()}
    for path, place in places.items():
        target = pages / place
        target.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix in PICTURES:
            shutil.copy(path, target)
        else:
            target.write_text(_linked(path, place, places, pages), encoding="utf-8")
    return sorted(place for place in places.values() if place.endswith(".md"))


def _linked(page: Path, place: str, places: dict[Path, str], pages: Path) -> str:
    """Text of a page with links from its place on the site; linked source files are copied."""

    def link(match: re.Match[str]) -> str:
        target = (page.parent / match[1]).resolve()
        if target not in places:
            if target.is_dir():
                return match[0].replace("](" + match[1], f"]({_relative('index.md', place)}")
            places_of_file = f"files/{target.relative_to(ROOT.resolve()).as_posix()}"
            copy = pages / places_of_file
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(target, copy)
            return f"]({_relative(places_of_file, place)})"
        return f"]({_relative(places[target], place)}{match[2] or ''})"

    return _LINK.sub(link, page.read_text(encoding="utf-8"))


def _relative(target: str, place: str) -> str:
    return Path(os.path.relpath(target, Path(place).parent)).as_posix()


def build() -> int:
    """Stage the pages and run zensical; return its exit code, or 1 where a page is damaged."""
    stage(SITE / "pages")
    done = subprocess.run(
        [
            *(sys.executable, "-m", "zensical", "build", "--clean", "--strict"),
            *("--config-file", str(CONFIGURATION)),
        ],
        cwd=DOCS,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    # zensical ends with a traceback where there are warnings, and colours them in any case.
    said = re.sub(r"\x1b\[[\d;]*m", "", done.stdout).partition("Traceback")[0]
    sys.stdout.write(said)
    # A fence that the parser does not understand is a text with three backquotes, and no warning.
    broken = [path for path in (SITE / "html").rglob("*.html") if "<p>```" in path.read_text()]
    for path in broken:
        sys.stderr.write(f"{path.relative_to(SITE)}: a block is not recognised\n")
    return done.returncode or int(bool(broken))


if __name__ == "__main__":
    sys.exit(build())
