"""Texts of the command line as the page shows them, and names of new files."""

from __future__ import annotations

import re
from pathlib import Path

_OPTION = re.compile(r"(?<![\w-])--([a-z][a-z-]*)")
_ELSEWHERE = re.compile(
    r", or (?:replace|write over) it \(--replace[^)]*\)"
    r"|(?:;|, or name it by) --column \"[^\"]*\"(?: where (?:it is none of them|one is))?"
    r"|, for `winchkit [^`]*`"
)
"""Ways that the page does not offer."""
INTERNAL = "failed by a fault of winchkit; the terminal that serves this page has the details"
"""In place of what an exception of Python says."""


def page_text(text: str) -> str:
    """A text whose options are words: ``name it by --sample-rate`` says ``by sample rate``."""
    return _OPTION.sub(lambda found: found[1].replace("-", " "), _ELSEWHERE.sub("", text))


def free_path(folder: Path, name: str) -> Path:
    """A new file of the folder: the name itself, else with the first free number."""
    path, number = folder / name, 2
    while path.exists():
        path, number = path.with_stem(f"{Path(name).stem}-{number}"), number + 1
    return path
