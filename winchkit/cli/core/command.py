"""A command of winchkit: with examples in its help, ``-q`` and ``-v``, and ``-`` for a file.

>>> @click.command(cls=Command, examples=("winchkit check bench.toml", "winchkit check *.csv"))
... def command() -> None: ...

A test executes every example (tests/cli/core/test_examples.py).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from time import monotonic
from typing import Any, NamedTuple

import click
from click.core import ParameterSource

from winchkit.cli.core.messages import detail, is_verbose, verbosity_options

LETTERS = {
    "b": "bench",
    "c": "column",
    "h": "help",
    "o": "output",
    "p": "profile",
    "q": "quiet",
    "v": "verbose",
    "y": "yes",
}
"""The one option of every letter, in all commands."""


_WRITTEN = frozenset({"--output", "--html", "--save-mapping", "--figures"})
"""Options that name a file to write."""


class Example(NamedTuple):
    """A command line for the help."""

    line: str
    not_run: str = ""
    """Why the test only parses it, such as hardware that it needs; empty: it is executed."""
    exit_code: int = 0
    """With which it ends."""


class _WithExamples(click.Command):
    """Help that ends with examples, and the options that all commands share."""

    def __init__(self, *args: Any, examples: Sequence[str | Example] = (), **options: Any) -> None:
        super().__init__(*args, **options)
        self.examples = tuple(
            item if isinstance(item, Example) else Example(item) for item in examples
        )
        self.params += verbosity_options()

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the examples, each in one line, so that it can be copied."""
        super().format_epilog(ctx, formatter)
        if self.examples:
            with formatter.section("Examples"):
                for example in self.examples:
                    formatter.write(f"{'':{formatter.current_indent}}{example.line}\n")


class ToolCommand(_WithExamples):
    """A command that does something."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the arguments; ``-`` is refused where no file is read."""
        try:
            rest = super().parse_args(ctx, args)
        except click.MissingParameter as error:
            own, said = error.param, error.format_message().removesuffix(".")
            if (variable := _shared_variable(own)) is not None:
                said += f": give its name or file, or set {variable}."
            elif isinstance(own, click.Option) and own.help and "\n" not in said:
                said += f" {own.metavar or ''}: {own.help}"
            else:
                raise
            raise click.UsageError(said, ctx) from None
        except click.NoSuchOption as error:
            meaning = LETTERS.get(error.option_name.removeprefix("-"))
            if meaning is None:
                raise
            raise click.UsageError(
                f"No such option '{error.option_name}': it is --{meaning} in every command, and "
                "this one has none.",
                ctx,
            ) from None
        for param in self.params:
            given = ctx.params.get(param.name or "")
            if "-" in (given if isinstance(given, tuple) else (given,)):
                _refuse_dash(param, ctx)
        return rest

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; with ``-v`` report what the environment decided, and the duration."""
        if not is_verbose():
            return super().invoke(ctx)
        for param in self.params:
            if ctx.get_parameter_source(param.name or "") is ParameterSource.ENVIRONMENT:
                detail(f"{param.opts[-1]} {ctx.params.get(param.name or '')} by {_variable(param)}")
        began = monotonic()
        try:
            return super().invoke(ctx)
        finally:
            detail(f"{ctx.command_path}: {monotonic() - began:.3f} s in all")


class Group(_WithExamples, click.Group):
    """A group of commands."""

    command_class = ToolCommand


def _variable(param: click.Parameter) -> str:
    named = [param.envvar] if isinstance(param.envvar, str) else param.envvar or ()
    return next((name for name in named if os.environ.get(name)), "the environment")


def _shared_variable(param: click.Parameter | None) -> str | None:
    """Environment variable that an option has in all commands; None where it has none."""
    if param is None or not isinstance(param.envvar, list):
        return None
    shared = {f"WINCHKIT_{name.removeprefix('--').upper()}" for name in param.opts}
    return next((name for name in param.envvar if name in shared), None)


def _refuse_dash(param: click.Parameter, ctx: click.Context) -> None:
    """Raise UsageError for ``-`` as the value of a parameter that reads no file."""
    name = max(param.opts, key=len) if isinstance(param, click.Option) else param.make_metavar(ctx)
    what = (
        "this writes a file, and not to standard output"
        if _WRITTEN.intersection(param.opts)
        else "this cannot come from standard input"
    )
    raise click.UsageError(f"{name} -: {what}; name it.", ctx)
