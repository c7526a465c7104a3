"""A click group that imports a command only when it is run: ``--help`` stays fast."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from typing import Any, NamedTuple

import click
from click.shell_completion import CompletionItem

from winchkit.cli.core.command import Group
from winchkit.errors import suggest

_PROGRAM = "WINCHKIT"
_SHARED = ("bench", "profile", "quiet", "verbose")
"""Options with one further variable for all commands, such as WINCHKIT_BENCH."""


class CommandPlace(NamedTuple):
    """Where a command is found, and its help in one line."""

    module: str
    help: str
    name: str = "command"
    """Of the click command within the module."""


Found = Callable[[], Iterable[tuple[str, str, CommandPlace]]]
"""Section, name and place of commands that are declared elsewhere."""


class LazyGroup(Group):
    """A group whose commands stand in tables until one is called; ``foreign`` are not listed."""

    def __init__(
        self,
        *args: Any,
        table: Mapping[str, CommandPlace] | None = None,
        sections: Mapping[str, Mapping[str, CommandPlace]] | None = None,
        further: Found = tuple,
        foreign: Found = tuple,
        **options: Any,
    ) -> None:
        super().__init__(*args, **options)
        self._sections = {"Commands": table or {}} if sections is None else sections
        self._own = {name: at for own in self._sections.values() for name, at in own.items()}
        self._further, self._foreign = further, foreign

    @cached_property
    def sections(self) -> Mapping[str, Mapping[str, CommandPlace]]:
        """Listed commands by subject."""
        found = {title: dict(entries) for title, entries in self._sections.items()}
        for title, name, at in self._further():
            found.setdefault(title, {})[name] = at
        return found

    @property
    def table(self) -> Mapping[str, CommandPlace]:
        """Listed commands by name."""
        return {name: at for section in self.sections.values() for name, at in section.items()}

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of the table."""
        return list(self.table)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the command."""
        entry = self._place(cmd_name)
        if entry is None:
            return None
        if find_spec(entry.module) is None:
            ctx.fail(f"'{cmd_name}' is not part of this installation.")
        command: click.Command = getattr(import_module(entry.module), entry.name)
        if ctx.auto_envvar_prefix:
            _name_variables(command, f"{ctx.auto_envvar_prefix}_{cmd_name}")
        return command

    def _place(self, name: str) -> CommandPlace | None:
        found = self._own.get(name) or self.table.get(name)
        return found or next((at for _, known, at in self._foreign() if known == name), None)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that the arguments begin with; a misspelt one gets a guess."""
        name = args[0] if args else ""
        if name and not name.startswith("-") and self._place(name) is None:
            ctx.fail(f"no command '{name}'{self._like(name)}")
        return super().resolve_command(ctx, args)

    def _like(self, name: str) -> str:
        """A command of a similar name, else the commands whose help has the word."""
        if close := suggest(name, list(self.table)):
            return close
        word = name.casefold()
        named = [
            f"'{key}'"
            for key, entry in self.table.items()
            if word in re.findall(r"\w+", entry.help.casefold())
        ]
        return f"; did you mean {' or '.join(named)}?" if named else ""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands of every section with the table's help, importing none."""
        width = max(map(len, self.table))
        for title, entries in self.sections.items():
            with formatter.section(title):
                rows = [(name.ljust(width), entry.help) for name, entry in entries.items()]
                formatter.write_dl(rows)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Complete a command's name, importing none."""
        names = [
            CompletionItem(name, help=entry.help)
            for name, entry in self.table.items()
            if name.startswith(incomplete)
        ]
        return names + click.Command.shell_complete(self, ctx, incomplete)


def _name_variables(command: click.Command, prefix: str) -> None:
    """Name the environment variables of a command by its options, not by click's argument names."""
    for option in command.params:
        if isinstance(option, click.Option) and option.envvar is None:
            typed = [name[2:] for name in option.opts if name.startswith("--")]
            own = [_variable(f"{prefix}_{name}") for name in typed]
            shared = [f"{_PROGRAM}_{_variable(name)}" for name in typed if name in _SHARED]
            option.envvar = [*own, *shared]
    if isinstance(command, click.Group):
        for name, inner in command.commands.items():
            _name_variables(inner, f"{prefix}_{name}")


def _variable(words: str) -> str:
    return words.replace("-", "_").upper()
