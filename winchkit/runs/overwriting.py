"""Refusal to write over a file that exists."""

from __future__ import annotations

from pathlib import Path

from winchkit.errors import UsageError


def refuse_existing(target: Path, replace: bool) -> None:
    """Raise UsageError where ``target`` exists and is not to be replaced."""
    if target.exists() and not replace:
        raise UsageError(
            f"{target} exists already; name another file, or write over it "
            "(--replace, in Python replace=True)"
        )
