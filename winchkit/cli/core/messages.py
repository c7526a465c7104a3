"""Messages of a command beside its result, on standard error: notes, steps, the next command.

``-q`` leaves all of it out, except warnings and errors. ``-v`` adds a line, with the time since the
start, for every file that was read, every default that was taken, and every step.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    import logging

_QUIET = "winchkit.quiet"
_VERBOSE = "winchkit.verbose"
COPY_OF_INPUT = "winchkit.standard_input"
"""Key of a context's ``meta``: the temporary file that has standard input."""
_PATTERN_FROM = 3
"""Number of files from which a pattern such as ``demo-*.csv`` is written in their place."""


def is_quiet() -> bool:
    """Whether the present command prints its result only (``-q``)."""
    return bool(_meta().get(_QUIET))


def is_verbose() -> bool:
    """Whether the present command reports its steps (``-v``)."""
    return _VERBOSE in _meta()


def note(text: str) -> None:
    """Report something beside the result, such as a file that was written."""
    if not is_quiet():
        click.echo(text, err=True)


def detail(text: str) -> None:
    """Report a step, with the time since the start, where ``-v`` asks for it."""
    began = _meta().get(_VERBOSE)
    if isinstance(began, float):
        click.echo(f"[{monotonic() - began:7.3f} s] {text}", err=True)


def suggest_next(*words: str | Sequence[str]) -> None:
    """Suggest the command that usually follows, but not beside JSON or for standard input."""
    from winchkit.cli.core.output import is_json

    context = click.get_current_context(silent=True)
    if context is None or is_json():
        return
    flat = [word for item in words for word in ([item] if isinstance(item, str) else item)]
    if context.meta.get(COPY_OF_INPUT) in flat:
        return
    quoted = [shlex.quote(item) if isinstance(item, str) else _files(item) for item in words]
    note(" ".join(["next: winchkit", *quoted]))


def _files(paths: Sequence[str]) -> str:
    """Files quoted for a shell; as a pattern where it stands for exactly these."""
    quoted = shlex.join(paths)
    first = Path(paths[0])
    names = [Path(path).name for path in paths]
    begin = _common(names)
    end = _common([name[len(begin) :][::-1] for name in names])[::-1]
    pattern = str(first.parent / f"{begin}*{end}")
    plain = pattern.replace("*", "", 1)
    if len(paths) < _PATTERN_FROM or shlex.quote(plain) != plain:
        return quoted
    same = sorted(map(Path, paths)) == sorted(first.parent.glob(f"{begin}*{end}"))
    return pattern if same else quoted


def _common(names: Sequence[str]) -> str:
    """What all names begin with."""
    columns = zip(*names, strict=False)
    return "".join(c[0] for c in takewhile(lambda column: len(set(column)) == 1, columns))


def verbosity_options() -> Sequence[click.Option]:
    """The options ``-q`` and ``-v``, which every command has."""
    return (
        click.Option(
            ["-q", "--quiet"],
            is_flag=True,
            expose_value=False,
            callback=_be_quiet,
            help="Print results, warnings and errors only.",
        ),
        click.Option(
            ["-v", "--verbose"],
            is_flag=True,
            expose_value=False,
            callback=_be_verbose,
            help="Report what is read and decided, and how long it takes.",
        ),
    )


def _be_quiet(ctx: click.Context, _param: click.Parameter, value: bool) -> None:
    if value:
        ctx.meta[_QUIET] = True
        _refuse_both(ctx)


def _be_verbose(ctx: click.Context, _param: click.Parameter, value: bool) -> None:
    if value and _VERBOSE not in ctx.meta and not ctx.resilient_parsing:
        ctx.meta[_VERBOSE] = monotonic()
        _refuse_both(ctx)
        _show_log(ctx)


def _refuse_both(ctx: click.Context) -> None:
    if _VERBOSE in ctx.meta and _QUIET in ctx.meta:
        raise click.UsageError("'--quiet' and '--verbose' exclude each other; choose one.")


def _show_log(ctx: click.Context) -> None:
    """Show what winchkit logs of its steps, until the command ends."""
    import logging

    class Details(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            detail(record.getMessage())

    logger, handler = logging.getLogger("winchkit"), Details(logging.INFO)
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)

    def end() -> None:
        logger.removeHandler(handler)
        logger.setLevel(before)

    ctx.find_root().call_on_close(end)


def _meta() -> dict[str, object]:
    context = click.get_current_context(silent=True)
    return {} if context is None else context.meta
