"""The option ``--html`` of compare, diagnose and add: the answer as a page beside the answer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from re import compile as pattern

import click

from winchkit.errors import Fault, FileError, UsageError

__all__ = ["html_option", "page_title", "pages_beside", "save_page", "write_page"]

html_option = click.option("--html", metavar="FILE", help="Also write the answer as one page.")
_RUNS_NAMED = 3
_NO_FILE = pattern(r"[^\w.-]")
_PAGE_BEGINS = b"<!DOCTYPE html>"


def write_page(path: str, page: str) -> None:
    """Write a page as :func:`save_page` does and say so on stderr."""
    save_page(path, page)
    click.echo(f"report: {path}", err=True)


def save_page(path: str, page: str) -> None:
    """Write a page; the folder is made where its parent exists.

    Raises FileError where it cannot be written, and for a file there that is no page: a run
    named after ``--html`` by mistake stays what it is.
    """
    target = Path(path)
    try:
        target.parent.mkdir(exist_ok=True)
        if target.is_file() and not _may_be_replaced(target):
            raise FileError(
                Fault("holds something else than a page and was left alone; name another", path)
            )
        target.write_text(page, encoding="utf-8")
    except OSError as error:
        reason = error.strerror or error
        raise FileError(
            Fault(f"the page cannot be written: {reason}; name another file for --html", path)
        ) from error


def pages_beside(path: str, winches: Sequence[str]) -> dict[str, str]:
    """Names of the winches' own pages beside the page of all: ``report-A.html``.

    Raises UsageError where two winches would get one page.
    """
    page = Path(path)
    names = {w: f"{page.stem}-{_NO_FILE.sub('-', w) or 'winch'}{page.suffix}" for w in winches}
    if len(set(names.values())) < len(names):
        raise UsageError(f"--html: no page for each of the winches {', '.join(winches)}")
    return names


def page_title(profile: str, runs: Sequence[str], effect: str = "") -> str:
    """``bench-spiral: a.csv, b.csv``, or ``bench-spiral: 12 runs, a.csv to l.csv``."""
    added = f" with {effect}" if effect else ""
    names = [Path(run).name for run in runs]
    told = ", ".join(names)
    if len(names) > _RUNS_NAMED:
        told = f"{len(names)} runs, {names[0]} to {names[-1]}"
    return f"{profile}{added}: {told}"


def _may_be_replaced(target: Path) -> bool:
    """Whether a file is empty or an earlier page."""
    with target.open("rb") as there:
        return there.read(len(_PAGE_BEGINS)) in {b"", _PAGE_BEGINS}
