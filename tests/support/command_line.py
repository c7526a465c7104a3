"""Command lines in the process of the test or their own; every command with its examples."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from typing import Any

import click
from click.testing import CliRunner, Result

from winchkit.cli import main
from winchkit.cli.core.command import Example


def invoke(*words: object, **options: Any) -> Result:
    """A command line; ``options`` as of CliRunner.invoke, e.g. ``input`` and ``env``."""
    return CliRunner().invoke(main, [*map(str, words)], **options)


def done(*words: object, code: int = 0, **options: Any) -> Result:
    """A command line that ends with a code; ``options`` as of :func:`invoke`."""
    result = invoke(*words, **options)
    assert result.exit_code == code, result.output
    return result


def own_process(
    *words: object, code: int | None = 0, **options: Any
) -> subprocess.CompletedProcess[str]:
    """A program in a process of its own, which ends with a code; None for any."""
    ended: subprocess.CompletedProcess[str] = subprocess.run(
        [*map(str, words)], capture_output=True, text=True, check=False, timeout=300, **options
    )
    assert code is None or ended.returncode == code, ended.stdout + ended.stderr
    return ended


def commands() -> Iterator[tuple[str, click.Command]]:
    """Each command and group with its words; the root has none."""
    yield "", main
    root = click.Context(main, info_name="winchkit", **main.context_settings)
    for name in main.table:
        yield from _below(root, main, name, name)


def examples() -> Iterator[tuple[str, Example]]:
    """Every example, with the words of its own command (not of the help that has it)."""
    known = dict(commands())
    for _, command in known.items():
        for example in getattr(command, "examples", ()):
            words = example.line.split()[1:]
            two = " ".join(words[:2])
            yield (two if two in known else words[0]), example


def _below(
    parent: click.Context, group: click.Group, name: str, words: str
) -> Iterator[tuple[str, click.Command]]:
    command = group.get_command(parent, name)
    assert command is not None, words
    yield words, command
    if isinstance(command, click.Group):
        inner = click.Context(command, parent=parent, info_name=name)
        for below in command.list_commands(inner):
            yield from _below(inner, command, below, f"{words} {below}")
