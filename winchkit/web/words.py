"""Texts of the command line as the page shows them: options in words."""

from __future__ import annotations

import re

_OPTION = re.compile(r"(?<![\w-])--([a-z][a-z-]*)")


def page_text(text: str) -> str:
    """A text whose options are words: ``name it by --sample-rate`` says ``by sample rate``."""
    return _OPTION.sub(lambda found: found[1].replace("-", " "), text)
