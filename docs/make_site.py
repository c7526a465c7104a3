"""Builds the documentation site: ``python docs/make_site.py``, with the extra ``docs``.

The pages and notebooks of docs/ and the pages of the top folder are copied to docs/site/pages, with
the links between them rewritten; zensical makes docs/site/html of them by docs/zensical.toml.
Warnings are errors.
"""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
ROOT = DOCS.parent
CONFIGURATION = DOCS / "zensical.toml"
SITE = DOCS / "site"
OUTSIDE = {
    "README.md": "readme.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "benchmarks/README.md": "benchmarks.md",
    "benchmarks/missing_physics/README.md": "missing-physics.md",
    ".github/SECURITY.md": "security.md",
}
"""Pages outside docs/, and their names on the site."""
PICTURES = (".svg", ".png")
_LINK = re.compile(r"\]\((?!\w+:|#)([^)\s#]+)(#[^)\s]*)?\)")


def sources() -> Iterator[tuple[Path, str]]:
    """Each page and picture, and its place on the site."""
    for path in sorted(DOCS.rglob("*")):
        place = path.relative_to(DOCS)
        if place.parts[0] in {"site", "changes"} or ".ipynb_checkpoints" in place.parts:
            continue
        if path.suffix in {".md", *PICTURES}:
            yield path, place.as_posix()
        elif path.suffix == ".ipynb":
            yield path, place.with_suffix(".md").as_posix()
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
            text = path.read_text(encoding="utf-8")
            if path.suffix == ".ipynb":
                text = notebook_page(json.loads(text), target)
            target.write_text(_linked(text, path, place, places, pages), encoding="utf-8")
    return sorted(place for place in places.values() if place.endswith(".md"))


def notebook_page(notebook: dict[str, Any], target: Path) -> str:
    """A notebook as Markdown: its cells, with texts and pictures that it holds as outputs."""
    parts = []
    for cell in notebook["cells"]:
        source = "".join(cell["source"]).strip()
        if cell["cell_type"] == "markdown":
            parts.append(source)
        elif cell["cell_type"] == "code" and source:
            parts.append(f"```python\n{source}\n```")
            parts += [_output(out, target, len(parts)) for out in cell["outputs"]]
    return "\n\n".join(part for part in parts if part) + "\n"


def _output(output: dict[str, Any], target: Path, number: int) -> str:
    """One output of a cell; a picture becomes a file beside the page."""
    data = output.get("data", {})
    name = f"{target.stem}-{number}"
    if "image/svg+xml" in data:
        target.with_name(f"{name}.svg").write_text("".join(data["image/svg+xml"]), encoding="utf-8")
        return f"![output]({name}.svg)"
    if "image/png" in data:
        picture = base64.b64decode("".join(data["image/png"]))
        target.with_name(f"{name}.png").write_bytes(picture)
        return f"![output]({name}.png)"
    text = "".join(output.get("text", data.get("text/plain", ""))).rstrip()
    return f"```text\n{text}\n```" if text else ""


def _linked(text: str, page: Path, place: str, places: dict[Path, str], pages: Path) -> str:
    """Text of a page with links from its place on the site; linked source files are copied."""

    def link(match: re.Match[str]) -> str:
        target = (page.parent / match[1]).resolve()
        if (pages / place).parent.joinpath(match[1]).is_file() and page.suffix == ".ipynb":
            return match[0]  # the picture of a notebook's output
        if target not in places:
            if target.is_dir():
                return match[0].replace("](" + match[1], f"]({_relative('index.md', place)}")
            places_of_file = f"files/{target.relative_to(ROOT.resolve()).as_posix()}"
            copy = pages / places_of_file
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(target, copy)
            return f"]({_relative(places_of_file, place)})"
        return f"]({_relative(places[target], place)}{match[2] or ''})"

    return _LINK.sub(link, text)


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
